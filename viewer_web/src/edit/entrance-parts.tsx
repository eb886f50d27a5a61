/** What the tab "Edit" shows of entrances and doors: the state that a click gives a door, a note, and the changes. */
import type { Review } from '../api/documents.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { Store } from '../store.ts';
import { type Entry, removeEntrance, setDoor } from './changes.ts';
import { ENTRANCE_WORDS } from './entrance-words.ts';

/** Live figures know nothing of marked doors. */
export function DoorsNote({ store }: { store: Store }) {
  const doors = store.reviewClient?.review.value?.doors ?? {};
  if (Object.keys(doors).length === 0) return null;
  return (
    <p class="callout" role="status" data-testid="doors-note">
      {ENTRANCE_WORDS.doorsNote}
    </p>
  );
}

export function DoorOption({ store }: { store: Store }) {
  const { doorState } = store.editing;
  return (
    <div class="segments" role="radiogroup" aria-label={ENTRANCE_WORDS.doorStates}>
      {(['open', 'shut'] as const).map((state) => (
        // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
        <button
          key={state}
          type="button"
          role="radio"
          aria-checked={doorState.value === state}
          onClick={() => {
            doorState.value = state;
          }}
        >
          {ENTRANCE_WORDS[state]}
        </button>
      ))}
    </div>
  );
}

/** Entrances in the order in which they were set: the route begins at the first. */
export function inOrder(entrances: Review['entrances']): Review['entrances'][string][] {
  return Object.keys(entrances)
    .sort((a, b) => a.length - b.length || (a < b ? -1 : 1))
    .map((id) => entrances[id]);
}

export function entranceEntries(review: Review, loaded: LoadedPlan | null, nameOf: (floor: string) => string): Entry[] {
  const entrances = inOrder(review.entrances).map(
    ({ id, floor }, i): Entry => ({
      key: `entrance ${id}`,
      title: ENTRANCE_WORDS.entrance,
      detail: i === 0 ? ENTRANCE_WORDS.routeBegins(nameOf(floor)) : nameOf(floor),
      swatch: 'swatch-entrance',
      back: removeEntrance(id),
      backLabel: ENTRANCE_WORDS.remove,
      floorId: floor,
    }),
  );
  const doors = Object.entries(review.doors).map(([id, state]): Entry => {
    const element = loaded?.stage.elements.find(({ sourceId }) => sourceId === id);
    return {
      key: `door ${id}`,
      title: ENTRANCE_WORDS.doorNow(element?.name || ENTRANCE_WORDS.door, state),
      detail: ENTRANCE_WORDS.doorDetail(nameOf(element?.floorId ?? '')),
      swatch: `swatch-door_${state}`,
      back: setDoor(id, null),
      backLabel: ENTRANCE_WORDS.asPlanned,
      floorId: element?.floorId ?? '',
    };
  });
  return [...entrances, ...doors];
}
