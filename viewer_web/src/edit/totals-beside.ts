/** The totals of the plan as it was made, and beside them those of the plan as edited. */
import type { Store } from '../store.ts';
import { isLive } from './readiness.ts';
import { hasEdits, stationsOf } from './review-stations.ts';
import { draftTotals, planTotals, previewTotals, type Totals } from './totals.ts';

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

/** Of what is shown: a preview, the draft, or the plan; null: nothing computes what edits are worth. */
export function totalsNow(store: Store): Totals | null {
  const plan = store.loaded.value?.plan;
  const head = store.editing.preview.value;
  const figures = store.reviewClient?.figures.value ?? null;
  if (plan === undefined) return null;
  if (store.editing.showsPlan.value && store.editing.underWay.value === null) return planTotals(plan);
  if (head !== null) return previewTotals(plan, head);
  if (figures !== null && isLive(store)) return draftTotals(plan, figures);
  return hasEdits(stationsOf(store)) ? null : planTotals(plan);
}
