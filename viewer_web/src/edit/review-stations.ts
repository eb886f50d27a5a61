/** The stations of the plan that is shown, as its review has them. */
import { OWN_PLAN } from '../load/plan-base.ts';
import type { PlanJson } from '../load/plan-json.ts';
import type { Store } from '../store.ts';
import { countEdits, type DraftStation, draftStations } from './draft.ts';

/** The stations as the review has them; the plan's where there is no review of it. */
export function stationsOf(store: Store): readonly DraftStation[] {
  const plan = store.loaded.value?.plan;
  return plan === undefined ? [] : stationsOfPlan(store, plan);
}

/** The same of a plan that is given. */
export function stationsOfPlan({ planBase, reviewClient }: Store, plan: PlanJson): readonly DraftStation[] {
  return draftStations(plan, planBase.value === OWN_PLAN ? (reviewClient?.review.value ?? null) : null);
}

/** Whether the review changes any station. */
export function hasEdits(stations: readonly DraftStation[]): boolean {
  const { moved, added, removed } = countEdits(stations);
  return moved + added + removed > 0;
}
