/**
 * Keys of editing: Shift and arrows move the chosen station over its floor, by the compass as the picture is turned; undo and redo, Escape and Enter for what is half done, Delete for the chosen
 * station.
 */
import { t } from '../language/language.ts';
import { counted } from '../panels/figures.ts';
import type { Store } from '../store.ts';
import { removeStation } from './changes.ts';
import { canEdit } from './readiness.ts';
import { stationsOf } from './review-stations.ts';
import { selectedStations } from './selected.ts';
import type { EditorActions } from './state.ts';

/** Returns what stops listening. */
export function listenToEditKeys(
  target: Window,
  store: Store,
  editor: EditorActions,
  heading: () => number,
): () => void {
  let nudging: Promise<void> | null = null;
  /** A move that Shift began ends with it, or where the page is left. */
  const settle = (event: Event): void => {
    if (nudging === null || (event instanceof KeyboardEvent && event.key !== 'Shift')) return;
    void nudging.then(() => editor.mover.finish());
    nudging = null;
  };
  const onKey = (event: KeyboardEvent): void => {
    if (isTyping(event.target) || event.altKey || !canEdit(store)) return;
    const step = event.shiftKey ? nudge(event.key, store, editor, heading()) : null;
    nudging = step ?? nudging;
    const isDone =
      step !== null || (event.ctrlKey || event.metaKey ? actOnChord(event, store) : actOnKey(event.key, store, editor));
    if (!isDone) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  // Before the keys of looking around, where Escape lets go of the station.
  target.addEventListener('keydown', onKey, { capture: true });
  target.addEventListener('keyup', settle);
  target.addEventListener('blur', settle);
  return () => {
    target.removeEventListener('keydown', onKey, { capture: true });
    target.removeEventListener('keyup', settle);
    target.removeEventListener('blur', settle);
  };
}

export const NUDGE_M = 0.1;
/** To the right of the picture, and into it. */
const NUDGES: Readonly<Record<string, readonly [number, number]>> = {
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
};

/** Along the axis of the scene that is nearest to where the arrow points in the picture. */
function nudge(key: string, store: Store, { mover }: EditorActions, headingRad: number): Promise<void> | null {
  const by = NUDGES[key];
  if (by === undefined || store.tab.peek() !== 'edit') return null;
  const quarters = Math.round(headingRad / (Math.PI / 2));
  const [cos, sin] = [Math.round(Math.cos((quarters * Math.PI) / 2)), Math.round(Math.sin((quarters * Math.PI) / 2))];
  const [right, ahead] = by.map((steps) => steps * NUDGE_M);
  const [eastM, northM] = [ahead * cos + right * sin, ahead * sin - right * cos];
  const several = selectedStations(store);
  if (several.length > 0) return mover.moveAll(several, eastM, northM);
  const station = stationsOf(store).find(({ id }) => id === store.stationId.peek());
  return station === undefined || station.isRemoved ? null : mover.nudge(station, eastM, northM);
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
    const several = selectedStations(store).filter(({ isFixed, isLocked }) => !isFixed && !isLocked);
    if (several.length > 0) {
      const changes = several.map(({ id }) => removeStation(id));
      void reviewClient?.commit(t('remove {stations}', { stations: counted(several.length, 'station') }), changes);
      return true;
    }
    const id = store.stationId.peek();
    if (id === null) return false;
    if (stationsOf(store).some((station) => station.id === id && station.isLocked)) {
      reviewClient?.warn(t('{id} is locked: unlock it first', { id }));
      return true;
    }
    void reviewClient?.commit(t('remove {id}', { id }), [removeStation(id)]);
  } else return false;
  return true;
}
