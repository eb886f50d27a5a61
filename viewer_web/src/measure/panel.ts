/** Which of the panels for measuring and sections is open. */
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

/** Open one of them, or close it where it is the open one. */
export function togglePanel({ measuring }: Store, view: PlanView, which: 'measure' | 'section'): void {
  const { panel } = measuring;
  const isOpen = panel.peek() === which;
  panel.value = isOpen ? null : which;
  measuring.measurer.peek()?.take(!isOpen && which === 'measure' ? 'distance' : null);
  // From there on arrows move the crosshair.
  if (!isOpen && which === 'measure') view.focus();
}

/** The building is cut by a box or along a line. */
export const hasSection = ({ sectionBox, sectionLine }: Store): boolean =>
  sectionBox.value !== null || sectionLine.value !== null;

/** Where the focus goes from a panel that closes: its button, or that of the group it is in. */
export const focusOpenerOf = (panel: 'measure' | 'section' | null): void =>
  (document.getElementById(`site-tool-${panel}`) ?? document.getElementById('tools-menu'))?.focus();
