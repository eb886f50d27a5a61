/** Keys of the tools: arrows move a crosshair, Enter takes a point, Backspace takes one back, Escape leaves. */
import { isTyping } from '../edit/keys.ts';
import type { Store } from '../store.ts';
import type { Measurer } from './measurer.ts';
import { focusOpenerOf } from './panel.ts';

const STEP_PIXELS = 10;
const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
};
/** Where arrows and Enter mean something else. */
const OTHERS = 'button, a, summary, input, [role=tablist], [role=application], [role=slider]';

/** Returns what stops listening. */
export function listenToMeasureKeys(target: Window, store: Store, measurer: Measurer): () => void {
  const onKey = (event: KeyboardEvent): void => {
    const { measuring } = store;
    if (measuring.panel.peek() === null || isTyping(event.target)) return;
    if (event.ctrlKey || event.metaKey || event.altKey || store.sheet.peek() !== null) return;
    const isElsewhere = event.target instanceof Element && event.target.closest(OTHERS) !== null;
    if (!act(event, store, measurer, isElsewhere)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  // Before the keys of editing and of looking around.
  target.addEventListener('keydown', onKey, { capture: true });
  return () => target.removeEventListener('keydown', onKey, { capture: true });
}

function act({ key, shiftKey }: KeyboardEvent, store: Store, measurer: Measurer, isElsewhere: boolean): boolean {
  const { measuring, isWalking } = store;
  const arrow = ARROWS[key];
  const hasTool = measuring.tool.peek() !== null;
  if (key === 'Escape') leave(store, measurer);
  else if (!hasTool || isElsewhere) return false;
  else if (arrow !== undefined && !isWalking.peek()) {
    const step = shiftKey ? 1 : STEP_PIXELS;
    measurer.moveCursor(step * arrow[0], step * arrow[1]);
  } else if (key === 'Enter' && measuring.cursor.peek() !== null) measurer.addAtCursor();
  else if (key === 'Enter') measurer.finish();
  else if (key === 'Backspace') measurer.takeBack();
  else return false;
  return true;
}

/** First of the points under way, then of the tool, then of the panel. */
function leave({ measuring }: Store, measurer: Measurer): void {
  const panel = measuring.panel.peek();
  if (measuring.points.peek().length > 0) measuring.points.value = [];
  else if (measuring.tool.peek() !== null) measurer.take(null);
  else measuring.panel.value = null;
  if (measuring.panel.peek() === null || measuring.tool.peek() === null) {
    focusOpenerOf(panel);
  }
}
