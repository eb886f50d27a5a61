/** The totals of the plan as it was made, and beside them those of the plan as edited. */
import type { Store } from '../store.ts';
import { isLive } from './readiness.ts';
import { hasEdits, stationsOf } from './review-stations.ts';
import { draftTotals, planTotals, type Totals } from './totals.ts';

export interface TotalsBeside {
  readonly planned: Totals;
  /** Whether the review changes any station. */
  readonly isEdited: boolean;
  /** Null: nothing is edited, or what the edited plan is worth is not known. */
  readonly edited: Totals | null;
  /** The edited plan's are of an older revision: those of this one are being computed. */
  readonly isStale: boolean;
}

/** Null until the plan is loaded. */
export function totalsBeside(store: Store): TotalsBeside | null {
  const plan = store.loaded.value?.plan;
  if (plan === undefined) return null;
  const planned = planTotals(plan);
  // The plan of a run is never edited: its stations are none of the review's.
  const isEdited = hasEdits(stationsOf(store));
  const [figures, review] = [store.reviewClient?.figures.value ?? null, store.reviewClient?.review.value ?? null];
  const isKnown = isEdited && figures !== null && isLive(store);
  return {
    planned,
    isEdited,
    edited: isKnown ? draftTotals(plan, figures) : null,
    isStale: isKnown && review !== null && figures.revision < review.revision,
  };
}
