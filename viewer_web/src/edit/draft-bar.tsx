/** The strip of totals above the canvas: what the edited plan is worth beside the plan as it was made. */
import { t } from '../language/language.ts';
import { reachedPercent } from '../panels/figures.ts';
import { MetWord, metInWords } from '../panels/requirements.tsx';
import type { Store } from '../store.ts';
import { countEdits, editsInWords } from './draft.ts';
import type { Latencies } from './preview-loop.ts';
import { canEdit, isLive } from './readiness.ts';
import { hasEdits, stationsOf } from './review-stations.ts';
import type { Editing } from './state.ts';
import { isAllMet, missedOf, planTotals, signedCount, signedPoints, type Totals } from './totals.ts';
import { totalsNow } from './totals-beside.ts';

export function DraftBar({ store }: { store: Store }) {
  const { reviewClient, editing, loaded } = store;
  const plan = loaded.value?.plan;
  if (reviewClient === null || plan === undefined) return null;
  const stations = stationsOf(store);
  const isEdited = hasEdits(stations);
  const isMoving = editing.underWay.value !== null;
  if (!isEdited && !isMoving && store.tab.value !== 'edit') return null;
  if (store.planBase.value !== '') return null;
  const totals = totalsNow(store);
  return (
    <section
      class={isStale(store) ? 'draft-bar draft-bar-stale' : 'draft-bar'}
      aria-label={t('Edited plan')}
      data-testid="draft-bar"
      ref={keepsHeight}
      {...measured(editing)}
    >
      {isEdited ? (
        <ShownChoice store={store} words={editsInWords(countEdits(stations))} />
      ) : (
        <span class="muted">{t('No stations edited')}</span>
      )}
      <TotalsList totals={totals} planned={planTotals(plan)} isLive={isLive(store)} />
      {canEdit(store) && <UndoButtons store={store} />}
    </section>
  );
}

/** As high as it once was at this width: where a line came and went, the building would jump under the pointer. */
function keepsHeight(bar: HTMLElement | null): void {
  if (bar === null) return;
  const width = `${bar.clientWidth}`;
  if (bar.dataset.width !== width) bar.style.minHeight = '';
  bar.dataset.width = width;
  bar.style.minHeight = `${bar.offsetHeight}px`;
}

/** For the record of tests: how long previews took so far, in milliseconds. */
function measured({ nDrags, answerTimes, drawTimes }: Editing) {
  const words = ({ ms }: Latencies): string => ms.map((each) => each.toFixed(1)).join(' ');
  return nDrags.value === 0 ? {} : { 'data-answered-ms': words(answerTimes), 'data-drawn-ms': words(drawTimes) };
}

/** The figures are of an older revision: those of this one are being computed. */
function isStale({ reviewClient, editing }: Store): boolean {
  const [figures, review] = [reviewClient?.figures.value ?? null, reviewClient?.review.value ?? null];
  return editing.preview.value === null && figures !== null && review !== null && figures.revision < review.revision;
}

function ShownChoice({ store, words }: { store: Store; words: string }) {
  const { showsPlan } = store.editing;
  return (
    <div class="segments" role="radiogroup" aria-label={t('Shown plan')}>
      {[false, true].map((isPlan) => (
        // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
        <button
          key={String(isPlan)}
          type="button"
          role="radio"
          aria-checked={showsPlan.value === isPlan}
          title={isPlan ? t('The original plan') : words}
          onClick={() => {
            showsPlan.value = isPlan;
          }}
        >
          {isPlan ? t('As planned') : t('Edited: {words}', { words })}
        </button>
      ))}
    </div>
  );
}

function TotalsList({ totals, planned, isLive }: { totals: Totals | null; planned: Totals; isLive: boolean }) {
  if (totals === null) {
    return <p class="muted">{isLive ? t('Computing …') : t('Coverage of the edited plan unknown')}</p>;
  }
  const connectivity = totals.nNetworks === 1 ? t('connected') : t('{n} unconnected groups', { n: totals.nNetworks });
  return (
    <dl data-testid="totals">
      {/* What may be wrong comes first. */}
      <Met totals={totals} />
      <div class={totals.lacksNetwork ? 'change-down' : ''}>
        <dt>{t('Links')}</dt>
        <dd>{totals.nLinks === null ? connectivity : `${totals.nLinks}, ${connectivity}`}</dd>
      </div>
      <Total
        name={t('Stations')}
        value={`${totals.nStations}`}
        change={signedCount(totals.nStations - planned.nStations)}
      />
      <Total
        name={t('Coverage')}
        value={reachedPercent(totals.coverage, totals.required)}
        change={signedPoints(totals.coverage - planned.coverage)}
        isBetterUp
      />
      {totals.floors.length > 1 &&
        totals.floors.map(({ id, name, coverage, required }) => (
          <Total
            key={id}
            name={name}
            value={reachedPercent(coverage, required)}
            change={signedPoints(coverage - (planned.floors.find((floor) => floor.id === id)?.coverage ?? coverage))}
            isBetterUp
          />
        ))}
    </dl>
  );
}

/** Of all requirements: beside the coverage of all, it would seem to speak of that alone. */
function Met({ totals }: { totals: Totals }) {
  const { requirements, unreachableM2 } = totals;
  const missed = missedOf(requirements);
  const isOne = requirements.length === 1;
  return (
    <div title={metInWords(totals)} data-testid="met">
      <dt>{isOne ? t('Requirement') : t('Requirements')}</dt>
      <dd>
        {missed.length > 0 && !isOne && `${t('{n} of {all}', { n: missed.length, all: requirements.length })} `}
        <MetWord isMet={isAllMet(totals)} isPartial={unreachableM2 > 0} />
      </dd>
    </div>
  );
}

interface TotalProps {
  readonly name: string;
  readonly value: string;
  /** With its sign; empty where there is none. */
  readonly change: string;
  readonly isBetterUp?: boolean;
}

function Total({ name, value, change, isBetterUp = false }: TotalProps) {
  const isUp = change.startsWith('+');
  return (
    <div>
      <dt>{name}</dt>
      <dd>
        {value}
        {change !== '' && <span class={isBetterUp === isUp ? ' change-up' : ' change-down'}> {change}</span>}
      </dd>
    </div>
  );
}

function UndoButtons({ store }: { store: Store }) {
  const { reviewClient } = store;
  if (reviewClient === null) return null;
  const [undo, redo] = [reviewClient.undoable.value, reviewClient.redoable.value];
  return (
    <span>
      <button
        type="button"
        class="icon"
        aria-label={undo === null ? t('Undo') : t('Undo: {undo}', { undo })}
        title={undo === null ? t('Nothing to undo') : t('Undo: {undo} (Ctrl-Z)', { undo })}
        disabled={undo === null}
        onClick={() => void reviewClient.undo()}
      >
        ↶
      </button>
      <button
        type="button"
        class="icon"
        aria-label={redo === null ? t('Redo') : t('Redo: {redo}', { redo })}
        title={redo === null ? t('Nothing to redo') : t('Redo: {redo} (Ctrl-Shift-Z)', { redo })}
        disabled={redo === null}
        onClick={() => void reviewClient.redo()}
      >
        ↷
      </button>
    </span>
  );
}
