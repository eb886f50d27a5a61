/** Says which stations other floors hide, and opens their floor at a click. */
import { t } from '../language/language.ts';
import { counted } from '../panels/figures.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import './covered-note.css';

export function CoveredNote({ store, view }: { store: Store; view: PlanView }) {
  const { chosen, nByFloor } = store.covered.value;
  const floors = store.loaded.value?.plan.floors ?? [];
  const nameOf = (id: string | null): string => floors.find((floor) => floor.id === id)?.name ?? '';
  const stations = store.shownStations.value;
  const named = chosen.flatMap(({ id, by }) => {
    const station = stations.find((one) => one.id === id);
    return station === undefined ? [] : [{ station, by }];
  });
  const hidden = floors.filter(({ id }) => nByFloor.has(id));
  const n = hidden.reduce((sum, { id }) => sum + (nByFloor.get(id) ?? 0), 0);
  if (store.isWalking.value || (named.length === 0 && n === 0)) return null;
  return (
    <aside class="covered" aria-label={t('Hidden stations')} data-testid="covered">
      {named.map(({ station, by }) => (
        <p key={station.id}>
          <span>
            {by === null
              ? t('{id} is inside, behind walls or roof', { id: station.id })
              : t('{id} is behind {floor}', { id: station.id, floor: nameOf(by) })}
          </span>
          <button
            type="button"
            class="chip chip-strong"
            onClick={() => {
              store.chooseFloor(station.floorId);
              view.approach(station.positionM, station.floorId);
            }}
          >
            {t('Open {floor}', { floor: nameOf(station.floorId) })}
          </button>
        </p>
      ))}
      {n > 0 && (
        <p>
          <span>
            {hidden.length > 1
              ? t('{stations} behind other floors', {
                  stations: counted(n, named.length === 0 ? 'station' : 'other'),
                })
              : t('{stations} behind another floor', {
                  stations: counted(n, named.length === 0 ? 'station' : 'other'),
                })}
          </span>
          {hidden
            .filter(({ id }) => named.every(({ station }) => station.floorId !== id))
            .map(({ id, name }) => (
              <button key={id} type="button" class="chip" onClick={() => store.chooseFloor(id)}>
                {t('Open {floor}', { floor: name })}
                {hidden.length > 1 && ` · ${nByFloor.get(id)}`}
              </button>
            ))}
        </p>
      )}
    </aside>
  );
}
