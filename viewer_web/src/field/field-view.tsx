/** The field view: where to go next, how far, and what is done. For a tablet in one hand, without a network. */

import { useMemo, useState } from 'preact/hooks';
import { hasEdits, stationsOfPlan } from '../edit/review-stations.ts';
import { t } from '../language/language.ts';
import type { FieldPlan } from '../load/fetch-plan.ts';
import { alongWays, coordinatesWords, counted, heightWords, lengthWords, unitName } from '../panels/figures.ts';
import { type Progress, progressOf } from '../review/progress.ts';
import type { Store } from '../store.ts';
import { FloorMap } from './floor-map.tsx';
import './field.css';
import { nextStop, routeStops, type Stop, wayLeft, wayTo } from './route.ts';
import { partnersOf } from './targets.ts';
import { readTicks, tickKey, writeTicks } from './ticks.ts';

interface FieldViewProps {
  readonly store: Store;
  readonly loaded: FieldPlan;
}

export function FieldView({ store, loaded }: FieldViewProps) {
  const stations = stationsOfPlan(store, loaded.plan);
  const stops = useMemo(() => routeStops(loaded.plan, stations), [loaded, store.reviewClient?.review.value]);
  const key = useMemo(() => tickKey(loaded.plan, window.location.pathname), [loaded]);
  const [ticked, setTicked] = useState(() => readTicks(window.localStorage, key));
  const progress = progressOf(store);
  const inReview = stops.map(({ stationId }) => stationId).filter((id) => progress[id]?.state === 'done');
  const done = new Set([...ticked, ...inReview]);
  const [picked, setPicked] = useState<string | null>(null);
  const next = stops.find(({ stationId }) => stationId === picked) ?? nextStop(stops, done);
  const tick = (stop: Stop, isDone: boolean): void => {
    const next = new Set(ticked);
    if (isDone) next.add(stop.stationId);
    else next.delete(stop.stationId);
    writeTicks(window.localStorage, key, next);
    setTicked(next);
    setPicked(null);
  };
  const left = wayLeft(loaded.plan, stops, done);
  const nDone = stops.filter(({ stationId }) => done.has(stationId)).length;
  return (
    <main class="field-view">
      <header class="field-head">
        <p>
          <strong data-testid="field-count">{t('{n} of {all}', { n: nDone, all: stops.length })}</strong> {t('done')}
          {left.lengthM > 0 && (
            <span class="muted">
              {' '}
              {t('· {length} to walk', { length: alongWays(lengthWords(left.lengthM, 0), left.nWithoutWay) })}
            </span>
          )}
        </p>
        <button
          type="button"
          class="field-quiet"
          onClick={() => {
            store.page.value = 'plan';
          }}
        >
          {t('Full plan')}
        </button>
      </header>
      <progress class="field-progress" value={nDone} max={Math.max(1, stops.length)} aria-label={t('Stations done')} />
      {hasEdits(stations) && (
        <p class="field-note">{t('Stations as edited in the review; ways to and from these are not known.')}</p>
      )}
      {next === null ? (
        <AllDone n={stops.length} />
      ) : (
        <NextStop
          {...{ stop: next, stops, done, progress }}
          targetsWith={partnersOf(loaded.plan, next)}
          onTick={tick}
        />
      )}
      <FloorMap
        loaded={loaded}
        floorId={(next ?? stops.at(-1))?.floorId ?? ''}
        stops={stops}
        next={next}
        done={done}
        onPick={({ stationId }) => setPicked(stationId)}
      />
      <StopList {...{ stops, done, progress, next }} onTick={tick} onPick={setPicked} />
    </main>
  );
}

function AllDone({ n }: { n: number }) {
  return (
    <section class="field-next" aria-live="polite">
      <h1>{t('All done')}</h1>
      <p>{t('{stations} scanned.', { stations: counted(n, 'station') })}</p>
    </section>
  );
}

function wayInWords(wayM: number | null, isFirst: boolean): string {
  if (wayM === null) return isFirst ? t('Start here') : t('Distance unknown');
  return wayM === 0 ? t('Here') : t('{length} to go', { length: lengthWords(wayM, wayM < 10 ? 1 : 0) });
}

interface NextStopProps {
  readonly stop: Stop;
  readonly stops: readonly Stop[];
  readonly done: ReadonlySet<string>;
  readonly progress: Progress;
  /** Stations that targets register it with. */
  readonly targetsWith: readonly string[];
  readonly onTick: (stop: Stop, isDone: boolean) => void;
}

function NextStop({ stop, stops, done, progress, targetsWith, onTick }: NextStopProps) {
  const wayM = wayTo(stop, stops, done);
  const isDone = done.has(stop.stationId);
  return (
    <section class="field-next" aria-live="polite" aria-label={t('Next station')}>
      <div class="field-number" data-testid="field-number" aria-hidden="true">
        {stop.number}
      </div>
      <div>
        <h1 data-testid="field-station">{stop.stationId}</h1>
        <p>{stop.floorName}</p>
        <p class="field-way" data-testid="field-way">
          {wayInWords(wayM, stop === stops[0])}
        </p>
        <p class="muted">
          {t('Sensor {height} above the ground · x, y {place} ({unit})', {
            height: heightWords(stop.heightM),
            place: coordinatesWords(stop.positionM.slice(0, 2)),
            unit: unitName(),
          })}
        </p>
        {targetsWith.length > 0 && (
          <p data-testid="field-targets">
            {t('Three targets each with {stations}: squares on the map', { stations: targetsWith.join(', ') })}
          </p>
        )}
      </div>
      <button type="button" class="field-done" {...inReviewOf(progress, stop)} onClick={() => onTick(stop, !isDone)}>
        {isDone ? t('Mark as not done') : t('Done')}
      </button>
    </section>
  );
}

interface StopListProps {
  readonly stops: readonly Stop[];
  readonly done: ReadonlySet<string>;
  readonly progress: Progress;
  readonly next: Stop | null;
  readonly onTick: (stop: Stop, isDone: boolean) => void;
  readonly onPick: (stationId: string) => void;
}

function StopList({ stops, done, progress, next, onTick, onPick }: StopListProps) {
  return (
    <ol class="field-stops" aria-label={t('Stations in route order')}>
      {stops.map((stop) => (
        <li key={stop.stationId} class={stop === next ? 'field-stop field-stop-next' : 'field-stop'}>
          <label>
            <input
              type="checkbox"
              aria-label={t('{id} done', { id: stop.stationId })}
              checked={done.has(stop.stationId)}
              {...inReviewOf(progress, stop)}
              onChange={(event) => onTick(stop, event.currentTarget.checked)}
            />
          </label>
          <button type="button" onClick={() => onPick(stop.stationId)}>
            <span class="dot" aria-hidden="true">
              {stop.number}
            </span>
            <span class="field-stop-name">
              {stop.stationId}
              <small>
                {progress[stop.stationId]?.state === 'skipped' ? `${stop.floorName} · ${t('skipped')}` : stop.floorName}
              </small>
            </span>
            <span class="muted">{stop.wayM === null ? '' : lengthWords(stop.wayM, 1)}</span>
          </button>
        </li>
      ))}
    </ol>
  );
}

/** What the review has as done is taken back there, not on this device. */
function inReviewOf(progress: Progress, { stationId }: Stop): { disabled?: boolean; title?: string } {
  return progress[stationId]?.state === 'done' ? { disabled: true, title: t('Done in the review') } : {};
}
