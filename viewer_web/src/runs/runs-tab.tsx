/** The tab "Runs" of the sidebar. */
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

interface RunsTabProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function RunsTab(_: RunsTabProps) {
  return null;
}
