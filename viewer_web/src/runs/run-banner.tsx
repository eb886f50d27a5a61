/** The strip over the canvas that says whose stations are shown where they are not the plan's, with the way back. */

import { useEffect } from 'preact/hooks';
import { watchableRun } from '../edit/draft-follower.ts';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { counted } from '../panels/figures.ts';
import type { Store } from '../store.ts';
import './runs.css';

export function RunBanner({ store }: { store: Store }) {
  const going = watchableRun(store);
  if (going !== null) return <WatchedRun store={store} run={going.id} />;
  return store.planBase.value === OWN_PLAN ? null : <OpenedPlan store={store} />;
}

/** A run that goes on: its best stations, or the plan's. */
function WatchedRun({ store, run }: { store: Store; run: string }) {
  const { watchesRun } = store.editing;
  const shown = store.planBase.value === OWN_PLAN ? t('the plan') : t('the plan that is open');
  return (
    <section class="run-banner" aria-label={t('Shown stations')} role="status">
      <p>
        {watchesRun.value
          ? t('Showing the best stations of run {run} so far; colours are those of the plan', { run })
          : t('Showing {shown} while run {run} goes on', { shown, run })}
      </p>
      <button
        type="button"
        class="button button-small"
        onClick={() => {
          watchesRun.value = !watchesRun.value;
        }}
      >
        {watchesRun.value ? t('Back to the plan') : t('Watch the run')}
      </button>
    </section>
  );
}

/** Another plan of the folder than the one the page was started for. */
function OpenedPlan({ store }: { store: Store }) {
  const { reviewClient, planBase, loaded } = store;
  const id = planBase.value.match(/^runs\/([^/]+)\//)?.[1];
  const run = reviewClient?.runs.value.find((one) => one.id === id);
  const session = reviewClient?.session.value ?? null;
  useEffect(() => {
    // For its title, and to know where it is deleted meanwhile.
    if (session !== null && !reviewClient?.knowsRuns.peek())
      reviewClient?.refreshRuns().catch((error: Error) => reviewClient.warn(error.message));
  }, [reviewClient, session]);
  const isGone = reviewClient?.knowsRuns.value === true && run === undefined && id !== undefined;
  return (
    <section class="run-banner" aria-label={t('Shown stations')} role="status">
      <p>
        {id === undefined ? t('Showing another plan') : t('Showing run {id}', { id })}
        {run?.title ? `, ${run.title}` : ''}
        {isGone ? `, ${t('which was deleted')}` : ''}: {counted(loaded.value?.plan.stations.length ?? 0, 'station')}
      </p>
      <a class="button button-small" href="#tab=runs">
        {t('Back to the plan')}
      </a>
    </section>
  );
}
