/** Whether a station is done or skipped, and the buttons that say so. */

import { timeInWords } from '../api/conflict-words.ts';
import { canComment } from '../edit/readiness.ts';
import { t } from '../language/language.ts';
import type { Store } from '../store.ts';
import { type ProgressState, progressOf, setProgress, stateInWords } from './progress.ts';
import './progress.css';

/** A check, or a bar; where it stands beside nothing that says it in words, those are its name. */
export function ProgressSign({ state, isNamed = false }: { state: ProgressState; isNamed?: boolean }) {
  const name = isNamed ? { role: 'img' as const, 'aria-label': stateInWords(state) } : { 'aria-hidden': true };
  return (
    <i class={`progress-sign progress-${state}`} title={stateInWords(state)} {...name}>
      {state === 'done' ? '✓' : ''}
    </i>
  );
}

export function ProgressButtons({ store, stationId }: { store: Store; stationId: string }) {
  const { reviewClient } = store;
  const progress = progressOf(store)[stationId];
  const mayChange = reviewClient !== null && canComment(store);
  if (!mayChange && progress === undefined) return null;
  const mark = (state: ProgressState): void => {
    const next = progress?.state === state ? null : state;
    const label =
      next === null
        ? t('take back how far {id} is', { id: stationId })
        : t('mark {id} as {state}', { id: stationId, state: stateInWords(next) });
    void reviewClient?.commit(label, [setProgress(stationId, next)]);
  };
  return (
    <div class="station-progress">
      {mayChange && (
        <div class="chips">
          <h3>{t('On site')}</h3>
          {(['done', 'skipped'] as const).map((state) => (
            <button
              key={state}
              type="button"
              class="chip"
              aria-pressed={progress?.state === state}
              onClick={() => mark(state)}
            >
              <ProgressSign state={state} /> {state === 'done' ? t('Done') : t('Skipped')}
            </button>
          ))}
        </div>
      )}
      {progress !== undefined && (
        <p class="muted">
          {progress.state === 'done'
            ? t('done by {by} {time}', { by: progress.by, time: timeInWords(progress.time) })
            : t('skipped by {by} {time}', { by: progress.by, time: timeInWords(progress.time) })}
        </p>
      )}
    </div>
  );
}
