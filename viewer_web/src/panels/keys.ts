/** The keyboard: floors by digit or up and down, stations by left and right, the camera by letters, Escape lets go. */
import { togglePanel } from '../measure/panel.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { isKeyOn } from './character-keys.ts';
import { listenToEscape } from './escape.ts';

/** Returns what stops listening. */
export function listenToKeys(target: Window, store: Store, view: PlanView): () => void {
  const onKey = (event: KeyboardEvent): void => {
    const { target: from } = event;
    const isForm =
      from instanceof HTMLInputElement || from instanceof HTMLTextAreaElement || from instanceof HTMLSelectElement;
    if (isForm || event.ctrlKey || event.metaKey || event.altKey || !isKeyOn(event.key)) return;
    if (act(event.key, store, view)) event.preventDefault();
  };
  const stopEscape = listenToEscape(target);
  target.addEventListener('keydown', onKey);
  return () => {
    stopEscape();
    target.removeEventListener('keydown', onKey);
  };
}

const TURN_RAD = Math.PI / 12;
const STEP = 0.8;

/** Turns the building: Q and E as in a walk, R and F up and down, + and - closer and away. */
function turn(key: string, view: PlanView): boolean {
  if (key === 'q') view.orbit(TURN_RAD, 0);
  else if (key === 'e') view.orbit(-TURN_RAD, 0);
  else if (key === 'r') view.orbit(0, -TURN_RAD);
  else if (key === 'f') view.orbit(0, TURN_RAD);
  else if (key === '+' || key === '=') view.orbit(0, 0, STEP);
  else if (key === '-') view.orbit(0, 0, 1 / STEP);
  else return false;
  return true;
}

/** Do what a key means; false where it means nothing. */
function act(key: string, store: Store, view: PlanView): boolean {
  const floors = store.loaded.value?.stage.floors ?? [];
  if (key === '0') store.chooseFloor(null);
  else if (/^[1-9]$/.test(key) && Number(key) <= floors.length) store.chooseFloor(floors[Number(key) - 1].id);
  else if (key === 'ArrowUp') store.stepFloor(1);
  else if (key === 'ArrowDown') store.stepFloor(-1);
  else if (key === 'ArrowRight') store.stepStation(1);
  else if (key === 'ArrowLeft') store.stepStation(-1);
  else if (key === 'Escape') store.clear();
  else if (key === 'h') view.showAll('side');
  else if (key === 't') view.showAll('top');
  else if (key === 'p') view.showPlan();
  else if (key === 'm') togglePanel(store, view, 'measure');
  else if (key === 'w') view.startWalk();
  else return !store.isWalking.peek() && turn(key.toLowerCase(), view);
  return true;
}
