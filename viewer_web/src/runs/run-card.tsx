/** One run: how far it is, the best it has found, and what can be done with it. */

import { useState } from 'preact/hooks';
import { timeInWords } from '../api/conflict-words.ts';
import type { Run } from '../api/documents.ts';
import type { ReviewClient } from '../api/review-client.ts';
import { showDifference } from '../compare/compare-section.tsx';
import { t } from '../language/language.ts';
import { counted } from '../panels/figures.ts';
import type { Store } from '../store.ts';
import { bestInWords, progressInWords, shareDone } from './run-words.ts';

const STATES: Readonly<Record<Run['state'], string>> = {
  running: t('running'),
  finished: t('finished'),
  cancelled: t('cancelled'),
  failed: t('failed'),
};

interface RunCardProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
  readonly run: Run;
  readonly mayChange: boolean;
}

export function RunCard({ store, reviewClient, run, mayChange }: RunCardProps) {
  const best = bestInWords(run);
  const isShown = store.planBase.value === run.plan;
  return (
    <li class="run" data-run={run.id} data-state={run.state}>
      <header>
        <strong>{run.title || run.id}</strong>
        <span class={`run-state run-${run.state}`}>{STATES[run.state]}</span>
      </header>
      <p class="muted">
        {run.id}, {timeInWords(run.created)}
        {run.resumed_from ? `, ${t('from {run}', { run: run.resumed_from })}` : ''}
        {isShown ? `, ${t('shown now')}` : ''}
      </p>
      {run.state === 'running' && <Progress run={run} />}
      {best !== '' && <p data-testid="run-best">{best}</p>}
      {run.message !== null && run.message !== '' && (
        <p class={run.state === 'failed' ? 'note note-warn' : 'note'}>{run.message}</p>
      )}
      <Warnings lines={run.warnings ?? []} />
      <RunButtons store={store} reviewClient={reviewClient} run={run} mayChange={mayChange} />
    </li>
  );
}

/** What the plan that was found has to be read with, such as how few stations it would take from scratch. */
function Warnings({ lines }: { lines: readonly string[] }) {
  if (lines.length === 0) return null;
  return (
    <details>
      <summary>{counted(lines.length, 'warning')}</summary>
      <ul class="muted">
        {lines.map((line) => (
          <li key={line}>{line}</li>
        ))}
      </ul>
    </details>
  );
}

function Progress({ run }: { run: Run }) {
  const share = shareDone(run);
  return (
    <div role="status">
      <progress aria-label={t('Run {id}', { id: run.id })} {...(share === null ? {} : { value: share })} />
      <p class="muted">{progressInWords(run)}</p>
    </div>
  );
}

function RunButtons({ store, reviewClient, run, mayChange }: RunCardProps) {
  const { id, plan, state } = run;
  const [isSure, setIsSure] = useState(false);
  const post = (what: 'cancel' | 'resume'): void => {
    reviewClient.client
      .post(`runs/${id}/${what}`, {})
      .then(() => reviewClient.refreshRuns())
      .catch((error: Error) => reviewClient.warn(error.message));
  };
  const remove = (): void => {
    reviewClient.client
      .delete(`runs/${id}`)
      .then(() => reviewClient.refreshRuns())
      .catch((error: Error) => reviewClient.warn(error.message));
  };
  const isOver = state !== 'running';
  return (
    <div class="buttons">
      {!isOver && mayChange && (
        <button
          type="button"
          class="button button-small"
          title={t('Stops, and keeps the best plan so far')}
          disabled={run.cancelling}
          onClick={() => post('cancel')}
        >
          {run.cancelling ? t('Stopping …') : t('Cancel')}
        </button>
      )}
      {isOver && plan !== null && store.planBase.value !== plan && (
        <>
          <a class="button button-small button-primary" href={`#plan=${plan}`}>
            {t('Open')}
          </a>
          <button
            type="button"
            class="button button-small"
            aria-pressed={store.compareBase.value === plan}
            onClick={() => showDifference(store, plan)}
          >
            {t('Compare')}
          </button>
        </>
      )}
      {isOver && mayChange && run.best !== null && (
        <button
          type="button"
          class="button button-small"
          title={reviewClient.runObstacle.value ?? t('A new run that begins with the best stations of this one')}
          disabled={reviewClient.runObstacle.value !== null}
          onClick={() => post('resume')}
        >
          {t('Resume')}
        </button>
      )}
      {isOver && mayChange && store.planBase.value !== plan && (
        <button
          type="button"
          class="button button-small button-quiet"
          onBlur={() => setIsSure(false)}
          onClick={() => (isSure ? remove() : setIsSure(true))}
        >
          {isSure ? t('Really delete?') : t('Delete')}
        </button>
      )}
    </div>
  );
}
