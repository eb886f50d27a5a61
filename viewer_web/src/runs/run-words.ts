/** A run in words: how far it is, and what it has found. */

import type { Run } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { counted, percent, whole } from '../panels/figures.ts';

/** Share of its stage that is done; null: not known. */
export function shareDone({ done, total }: Run): number | null {
  return done === null || total === null || total <= 0 ? null : Math.min(1, done / total);
}

export function progressInWords(run: Run): string {
  const stage = run.stage ?? t('starting');
  const share = shareDone(run);
  const steps =
    share === null || run.done === null || run.total === null
      ? ''
      : ` ${t('{n} of {all}', { n: whole(run.done), all: whole(run.total) })}`;
  return run.note ? `${stage}${steps}: ${run.note}` : `${stage}${steps}`;
}

/** "14 stations, lower bound 12, 95.2 % coverage"; empty where nothing was found yet. */
export function bestInWords({ best }: Run): string {
  if (best === null) return '';
  const parts = [counted(best.n_stations, 'station')];
  if (best.lower_bound !== null) {
    parts.push(
      best.lower_bound >= best.n_stations ? t('proven minimum') : t('lower bound {n}', { n: whole(best.lower_bound) }),
    );
  }
  if (best.fraction_of_achievable !== null)
    parts.push(t('{percent} coverage', { percent: percent(best.fraction_of_achievable) }));
  return parts.join(', ');
}
