/** Clicks on a station: one alone, or one more of several with Shift or while several are selected. */
import { batch } from '@preact/signals';
import type { Store } from '../store.ts';

/** `letsGo`: a click on what is chosen lets it go, as in lists. */
export function clickStation(store: Store, id: string, event: { readonly shiftKey: boolean }, letsGo = false): void {
  const { measuring, selectsSeveral, selection, stationId } = store;
  if (measuring.tool.peek() !== null) measuring.measurer.peek()?.addStation(id);
  else if (event.shiftKey || selectsSeveral.peek()) toggle(store, id);
  else {
    batch(() => {
      selection.value = NONE;
      store.chooseStation(letsGo && stationId.peek() === id ? null : id);
    });
  }
}

const NONE: ReadonlySet<string> = new Set();

/** The one that was chosen before is the first of several. */
function toggle(store: Store, id: string): void {
  const { selection, stationId } = store;
  const chosen = stationId.peek();
  const several = new Set(selection.peek().size === 0 && chosen !== null ? [chosen] : selection.peek());
  if (!several.delete(id)) several.add(id);
  batch(() => {
    // The view stays where it is: the next one is clicked in it.
    stationId.value = null;
    selection.value = several;
  });
}

export function selectNone({ selection, selectsSeveral }: Store): void {
  batch(() => {
    selection.value = NONE;
    selectsSeveral.value = false;
  });
}
