/** All stations of the shown floors, in the order to walk or by one of their figures. */
import { useEffect, useRef, useState } from 'preact/hooks';
import { countingOf } from '../network/graph.ts';
import { squareMetres } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { rowsOf, type SortKey, type StationRow, sorted } from './station-order.ts';

const COLUMNS: readonly [SortKey, string, string][] = [
  ['order', '#', 'In the order to walk'],
  ['id', 'Station', 'By name'],
  ['sees', 'sees', 'Area it sees by itself'],
  ['adds', 'adds', 'Area that the plan would lose without it'],
  ['links', 'links', 'Stations it registers with'],
];

export function StationList({ store }: { store: Store }) {
  const [key, setKey] = useState<SortKey>('order');
  const loaded = store.loaded.value;
  if (loaded === null) return null;
  const floorId = store.floorId.value;
  const onFloor = store.shownStations.value.filter((station) => floorId === null || station.floorId === floorId);
  const rows = sorted(rowsOf(onFloor, loaded.plan, store.shownLinks.value, countingOf(loaded.plan)), key);
  return (
    <Section title="Stations" aside={String(rows.length)}>
      <div class="row-station row-heads" role="toolbar" aria-label="Order of the stations">
        {COLUMNS.map(([one, title, hint]) => (
          <button key={one} type="button" aria-pressed={key === one} title={hint} onClick={() => setKey(one)}>
            {title}
          </button>
        ))}
      </div>
      <ul class="rows" aria-label="Stations">
        {rows.map((row) => (
          <Row key={row.station.id} store={store} row={row} />
        ))}
      </ul>
      {rows.length === 0 && <p class="muted">No station stands on this floor.</p>}
    </Section>
  );
}

function Row({ store, row: { station, seesM2, addsM2, nLinks } }: { store: Store; row: StationRow }) {
  const isChosen = store.stationId.value === station.id;
  const row = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (isChosen) row.current?.scrollIntoView({ block: 'nearest' });
  }, [isChosen]);
  const area = (m2: number | null): string => (m2 === null ? '–' : squareMetres(m2));
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
        <span>{area(seesM2)}</span>
        <span>{area(addsM2)}</span>
        <span>{nLinks}</span>
      </button>
    </li>
  );
}
