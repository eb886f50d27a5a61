/** The tab "Runs": planning again from the browser, how far runs are, and what came of them. */
import { useEffect } from 'preact/hooks';
import { CompareSection } from '../compare/compare-section.tsx';
import '../edit/desk.css';
import { OWN_PLAN } from '../load/plan-base.ts';
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
  const { desk } = store;
  const session = desk?.session.value ?? null;
  useEffect(() => {
    if (session !== null) void desk?.refreshRuns().catch((error: Error) => desk.warn(error.message));
  }, [desk, session]);
  if (desk === null) return null;
  if (session === null) {
    return <p class="callout">This server only shows files. Start `tlsplan view` of this version to plan again.</p>;
  }
  const runs = [...desk.runs.value].reverse();
  return (
    <>
      {store.planBase.value !== OWN_PLAN && <OtherPlanNote store={store} />}
      {session.read_only ? (
        <p class="callout">The server was started with --read-only. Start it without, and plans can be made here.</p>
      ) : (
        <RunFormSection store={store} desk={desk} />
      )}
      <Section title="Runs" aside={runs.length === 0 ? '' : `${runs.length}`}>
        {runs.length === 0 && <p class="muted">None yet.</p>}
        <ul class="runs" aria-label="Runs">
          {runs.map((run) => (
            <RunCard key={run.id} store={store} desk={desk} run={run} mayChange={!session.read_only} />
          ))}
        </ul>
      </Section>
      <CompareSection store={store} />
    </>
  );
}

function OtherPlanNote({ store }: { store: Store }) {
  const run = store.planBase.value.match(/^runs\/([^/]+)\//)?.[1];
  return (
    <div class="callout">
      {run === undefined ? 'Another plan is shown.' : `The plan of run ${run} is shown.`}
      <div class="buttons">
        <a class="button button-small" href="#tab=runs">
          Back to the plan
        </a>
      </div>
    </div>
  );
}
