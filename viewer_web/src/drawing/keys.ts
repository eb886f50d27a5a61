/** Keys of correcting a drawing: undo and redo, Delete, Escape, arrows. */
import { isTyping } from '../edit/keys.ts';
import type { DrawingEditor } from './editor.ts';
import { middleOf, placeOpening, remove, shiftWall } from './edits.ts';
import { type Corner, plus } from './geometry.ts';

const [STEP_M, LARGE_STEP_M] = [0.01, 0.1];
const ARROWS: Readonly<Record<string, Corner>> = {
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
};

/** Returns what stops listening. */
export function listenToDrawingKeys(target: Window, editor: DrawingEditor, mayChange: () => boolean): () => void {
  const onKey = (event: KeyboardEvent): void => {
    if (isTyping(event.target) || event.altKey) return;
    if (!actOn(event, editor, mayChange())) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  target.addEventListener('keydown', onKey);
  return () => target.removeEventListener('keydown', onKey);
}

type Pressed = Pick<KeyboardEvent, 'key' | 'shiftKey' | 'ctrlKey' | 'metaKey'>;

/** Whether a key meant something. */
export function actOn(
  { key, shiftKey, ctrlKey, metaKey }: Pressed,
  editor: DrawingEditor,
  mayChange: boolean,
): boolean {
  if (key === 'Escape') return letGo(editor);
  if (!mayChange) return false;
  if (ctrlKey || metaKey) {
    const letter = key.toLowerCase();
    if (letter === 'z' && !shiftKey) editor.undo();
    else if (letter === 'y' || letter === 'z') editor.redo();
    else return false;
    return true;
  }
  const [drawn, chosen, number] = [editor.drawn.peek(), editor.chosen.peek(), editor.storey.peek()];
  if (drawn === null || chosen === null) return false;
  if (key === 'Delete' || key === 'Backspace') {
    editor.change(remove(drawn, number, chosen));
    editor.chosen.value = null;
    return true;
  }
  const way = ARROWS[key];
  if (way === undefined) return false;
  const by = plus([0, 0], way, shiftKey ? LARGE_STEP_M : STEP_M);
  if (chosen.kind === 'wall') editor.change(shiftWall(drawn, number, chosen.id, by));
  else {
    const opening = drawn.storeys[number].openings.find(({ id }) => id === chosen.id);
    const placed = opening && placeOpening(drawn, number, chosen.id, plus(middleOf(opening.corners), by));
    if (placed) editor.change(placed);
  }
  return true;
}

/** First of what is half drawn, then of the tool, then of what is chosen. */
function letGo(editor: DrawingEditor): boolean {
  if (editor.begun.peek().length > 0) editor.begun.value = [];
  else if (editor.tool.peek() !== 'select') editor.tool.value = 'select';
  else if (editor.chosen.peek() !== null) editor.chosen.value = null;
  else return false;
  return true;
}
