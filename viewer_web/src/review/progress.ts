/** How far the crew came with each station, as the review has it. */
import type { Change, Review } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { Store } from '../store.ts';

export type ProgressState = 'done' | 'skipped';
export type Progress = Review['progress'];

const NONE: Progress = {};

/** By station; of the plan of a run nothing: its stations are others, though of the same names. */
export function progressOf({ planBase, reviewClient }: Store): Progress {
  return planBase.value === OWN_PLAN ? (reviewClient?.review.value?.progress ?? NONE) : NONE;
}

export const setProgress = (station: string, state: ProgressState | null): Change => ({
  kind: 'set_progress',
  station,
  state,
});

export const stateInWords = (state: ProgressState): string => (state === 'done' ? t('done') : t('skipped'));
