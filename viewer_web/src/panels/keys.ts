/** The keyboard: floors by digit or up and down, stations by left and right, Escape lets go. */
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

/** Returns what stops listening. */
export function listenToKeys(target: Window, store: Store, view: PlanView): () => void {
  const onKey = (event: KeyboardEvent): void => {
    const { target: from } = event;
    const isForm =
      from instanceof HTMLInputElement || from instanceof HTMLTextAreaElement || from instanceof HTMLSelectElement;
    if (isForm || event.ctrlKey || event.metaKey || event.altKey) return;
    if (act(event.key, store, view)) event.preventDefault();
  };
  target.addEventListener('keydown', onKey);
  return () => target.removeEventListener('keydown', onKey);
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
  else if (key === 'w') view.startWalk();
  else return false;
  return true;
}
