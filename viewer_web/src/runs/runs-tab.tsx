/** The tab "Runs": planning again from the browser, how far runs are, and what came of them. */

import { useEffect } from 'preact/hooks';
import { CompareSection } from '../compare/compare-section.tsx';
import { t } from '../language/language.ts';
import '../edit/edit.css';
import { COMMENT_ONLY, whyNoServer } from '../edit/readiness.ts';
import { Section } from '../panels/section.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { RunCard } from './run-card.tsx';
import { RunFormSection } from './run-form.tsx';
import './runs.css';

interface RunsTabProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function RunsTab({ store }: RunsTabProps) {
  const { reviewClient } = store;
  const session = reviewClient?.session.value ?? null;
  useEffect(() => {
    if (session !== null) void reviewClient?.refreshRuns().catch((error: Error) => reviewClient.warn(error.message));
  }, [reviewClient, session]);
  if (reviewClient === null) return null;
  if (session === null) return <p class="callout">{whyNoServer(reviewClient)}</p>;
  const mayChange = !session.read_only && !session.comment_only;
  const runs = [...reviewClient.runs.value].reverse();
  return (
    <>
      {session.read_only ? (
        <p class="callout">
          {t('The server was started with --read-only. Restart it without this option to plan here.')}
        </p>
      ) : session.comment_only ? (
        <p class="callout">{COMMENT_ONLY}</p>
      ) : (
        <RunFormSection store={store} reviewClient={reviewClient} />
      )}
      <Section title={t('Runs')} aside={runs.length === 0 ? '' : `${runs.length}`}>
        {runs.length === 0 && <p class="muted">{t('No runs yet.')}</p>}
        <ul class="runs" aria-label={t('Runs')}>
          {runs.map((run) => (
            <RunCard key={run.id} store={store} reviewClient={reviewClient} run={run} mayChange={mayChange} />
          ))}
        </ul>
      </Section>
      <CompareSection store={store} />
    </>
  );
}
