/** Says which stations other floors hide, and opens their floor at a click. */
import { counted } from '../panels/figures.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import './covered-note.css';

export function CoveredNote({ store, view }: { store: Store; view: PlanView }) {
  const { chosen, nByFloor } = store.covered.value;
  const floors = store.loaded.value?.plan.floors ?? [];
  const nameOf = (id: string | null): string => floors.find((floor) => floor.id === id)?.name ?? '';
  const station = store.shownStations.value.find(({ id }) => id === chosen?.id);
  const hidden = floors.filter(({ id }) => nByFloor.has(id));
  const n = hidden.reduce((sum, { id }) => sum + (nByFloor.get(id) ?? 0), 0);
  if (store.isWalking.value || (station === undefined && n === 0)) return null;
  return (
    <aside class="covered" aria-label="Hidden stations" data-testid="covered">
      {chosen !== null && station !== undefined && (
        <p>
          <span>
            {chosen.by === null
              ? `${chosen.id} is inside, behind walls or roof`
              : `${chosen.id} is behind ${nameOf(chosen.by)}`}
          </span>
          <button
            type="button"
            class="chip chip-strong"
            onClick={() => {
              store.chooseStation(chosen.id);
              view.approach(station.positionM, station.floorId);
            }}
          >
            Open {nameOf(station.floorId)}
          </button>
        </p>
      )}
      {n > 0 && (
        <p>
          <span>
            {counted(n, chosen === null ? 'station' : 'other station')} behind {hidden.length > 1 ? 'other' : 'another'}{' '}
            floor{hidden.length > 1 ? 's' : ''}
          </span>
          {hidden
            .filter(({ id }) => id !== station?.floorId)
            .map(({ id, name }) => (
              <button key={id} type="button" class="chip" onClick={() => store.chooseFloor(id)}>
                Open {name}
                {hidden.length > 1 && ` · ${nByFloor.get(id)}`}
              </button>
            ))}
        </p>
      )}
    </aside>
  );
}
