/** All stations of the shown floors, in route order or by one of their figures. */

import { useEffect, useRef, useState } from 'preact/hooks';
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { countingOf } from '../network/graph.ts';
import { areaWords } from '../panels/figures.ts';
import { reveal } from '../panels/reveal.ts';
import { Section } from '../panels/section.tsx';
import { progressOf } from '../review/progress.ts';
import { ProgressSign } from '../review/progress-sign.tsx';
import type { Store } from '../store.ts';
import { lossWords } from './losses.ts';
import { clickStation, selectNone } from './select.ts';
import { rowsOf, type SortKey, type StationRow, sorted } from './station-order.ts';

function columnsOf(plan: PlanJson): readonly (readonly [SortKey, string, string])[] {
  const { name, hint } = lossWords(plan);
  return [
    ['order', '#', t('Route order')],
    ['id', t('Station'), t('By name')],
    ['seen', t('Seen area'), t('Area this station sees by itself')],
    ['lost', name, hint],
    ['links', t('Links'), t('Stations it registers with')],
  ];
}

export function StationList({ store }: { store: Store }) {
  const [key, setKey] = useState<SortKey>('order');
  const loaded = store.loaded.value;
  if (loaded === null) return null;
  const floorId = store.floorId.value;
  const onFloor = store.shownStations.value.filter((station) => floorId === null || station.floorId === floorId);
  const rows = sorted(rowsOf(onFloor, loaded.plan, store.shownLinks.value, countingOf(loaded.plan)), key);
  return (
    <Section title={t('Stations')} aside={String(rows.length)}>
      {!store.isStatic && (
        <label class="check">
          <input
            type="checkbox"
            checked={store.selectsSeveral.value}
            onChange={(event) => {
              if (event.currentTarget.checked) store.selectsSeveral.value = true;
              else selectNone(store);
            }}
          />
          {t('Select several (or Shift-click)')}
        </label>
      )}
      <div class="row-station row-heads" role="toolbar" aria-label={t('Order of the stations')}>
        {columnsOf(loaded.plan).map(([one, title, hint]) => (
          <button key={one} type="button" aria-pressed={key === one} title={hint} onClick={() => setKey(one)}>
            {title}
          </button>
        ))}
      </div>
      <ul class="rows" aria-label={t('Stations')}>
        {rows.map((row) => (
          <Row key={row.station.id} store={store} row={row} />
        ))}
      </ul>
      {rows.length === 0 && <p class="muted">{t('No stations on this floor.')}</p>}
    </Section>
  );
}

function Row({ store, row: { station, seenM2, lostM2, nLinks } }: { store: Store; row: StationRow }) {
  const isChosen = store.stationId.value === station.id || store.selection.value.has(station.id);
  const row = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (isChosen) reveal(row.current);
  }, [isChosen]);
  const progress = progressOf(store)[station.id];
  const area = (m2: number | null): string => (m2 === null ? '–' : areaWords(m2));
  return (
    <li>
      <button
        ref={row}
        type="button"
        class={isChosen ? 'row row-station row-chosen' : 'row row-station'}
        aria-pressed={isChosen}
        data-station={station.id}
        onClick={(event) => clickStation(store, station.id, event, true)}
      >
        <span class="dot" aria-hidden="true">
          {station.number}
        </span>
        <span class="row-name">
          {station.id} {progress !== undefined && <ProgressSign state={progress.state} isNamed />}
        </span>
        <span>{area(seenM2)}</span>
        <span>{area(lostM2)}</span>
        <span>{nLinks}</span>
      </button>
    </li>
  );
}
