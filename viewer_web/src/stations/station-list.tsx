/** All stations of the shown floors in the order to walk. */
import { useEffect, useRef } from 'preact/hooks';
import type { PlanStation } from '../load/plan-json.ts';
import { squareMetres } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';

export function StationList({ store }: { store: Store }) {
  const loaded = store.loaded.value;
  if (loaded === null) return null;
  const { stations, floors } = loaded.plan;
  const floorId = store.floorId.value;
  const shown = stations.filter((station) => floorId === null || station.floor === floorId);
  const nameOf = (id: string): string => floors.find((floor) => floor.id === id)?.name ?? id;
  return (
    <Section title="Stations" aside="area seen">
      <ul class="rows" aria-label="Stations">
        {shown.map((station) => (
          <StationRow
            key={station.id}
            store={store}
            station={station}
            place={floorId === null ? nameOf(station.floor) : ''}
          />
        ))}
      </ul>
      {shown.length === 0 && <p class="muted">No station stands on this floor.</p>}
    </Section>
  );
}

function StationRow({ store, station, place }: { store: Store; station: PlanStation; place: string }) {
  const isChosen = store.stationId.value === station.id;
  const row = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (isChosen) row.current?.scrollIntoView({ block: 'nearest' });
  }, [isChosen]);
  return (
    <li>
      <button
        ref={row}
        type="button"
        class={isChosen ? 'row row-station row-chosen' : 'row row-station'}
        aria-pressed={isChosen}
        data-station={station.id}
        onClick={() => store.chooseStation(isChosen ? null : station.id)}
      >
        <span class="dot" aria-hidden="true">
          {station.order}
        </span>
        <span class="row-name">{station.id}</span>
        <span class="muted row-place">{place}</span>
        <span class="row-area">{squareMetres(station.covered_area_m2)}</span>
      </button>
    </li>
  );
}
