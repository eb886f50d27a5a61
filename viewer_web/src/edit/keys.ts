/** Keys of editing: undo and redo, Escape and Enter for what is half done, Delete for the chosen station. */
import type { Store } from '../store.ts';
import { removeStation } from './changes.ts';
import { canEdit } from './readiness.ts';
import type { EditorActions } from './state.ts';

/** Returns what stops listening. */
export function listenToEditKeys(target: Window, store: Store, editor: EditorActions): () => void {
  const onKey = (event: KeyboardEvent): void => {
    if (isTyping(event.target) || event.altKey || !canEdit(store)) return;
    const isDone = event.ctrlKey || event.metaKey ? actOnChord(event, store) : actOnKey(event.key, store, editor);
    if (!isDone) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  // Before the keys of looking around, where Escape lets go of the station.
  target.addEventListener('keydown', onKey, { capture: true });
  return () => target.removeEventListener('keydown', onKey, { capture: true });
}

export function isTyping(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLTextAreaElement ||
    target instanceof HTMLSelectElement ||
    (target instanceof HTMLInputElement && target.type !== 'range' && target.type !== 'checkbox')
  );
}

function actOnChord({ key, shiftKey }: KeyboardEvent, store: Store): boolean {
  const letter = key.toLowerCase();
  if (letter === 'z' && !shiftKey) void store.reviewClient?.undo();
  else if ((letter === 'z' && shiftKey) || letter === 'y') void store.reviewClient?.redo();
  else return false;
  return true;
}

function actOnKey(key: string, store: Store, { areas, mover }: EditorActions): boolean {
  const { editing, reviewClient } = store;
  const hasOutline = editing.outline.peek().length > 0;
  if (key === 'Escape' && editing.underWay.peek() !== null) mover.cancel();
  else if (key === 'Escape' && hasOutline) areas.dropOutline();
  else if (key === 'Escape' && editing.tool.peek() !== 'select') editing.tool.value = 'select';
  else if (key === 'Enter' && hasOutline) void areas.finishOutline();
  else if (key === 'Backspace' && hasOutline) areas.takeCornerBack();
  else if (key === 'Delete' && store.tab.peek() === 'edit') {
    const id = store.stationId.peek();
    if (id === null) return false;
    void reviewClient?.commit(`remove ${id}`, [removeStation(id)]);
  } else return false;
  return true;
}
