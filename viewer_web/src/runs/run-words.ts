/** A run in words: how far it is, and what it has found. */
import type { Run } from '../api/documents.ts';
import { counted, percent, whole } from '../panels/figures.ts';

/** Share of its stage that is done; null: not known. */
export function shareDone({ done, total }: Run): number | null {
  return done === null || total === null || total <= 0 ? null : Math.min(1, done / total);
}

export function progressInWords(run: Run): string {
  const stage = run.stage ?? 'starting';
  const share = shareDone(run);
  const steps =
    share === null || run.done === null || run.total === null ? '' : ` ${whole(run.done)} of ${whole(run.total)}`;
  return run.note ? `${stage}${steps}: ${run.note}` : `${stage}${steps}`;
}

/** "14 stations, lower bound 12, 95.2 % coverage"; empty where nothing was found yet. */
export function bestInWords({ best }: Run): string {
  if (best === null) return '';
  const parts = [counted(best.n_stations, 'station')];
  if (best.lower_bound !== null) {
    parts.push(best.lower_bound >= best.n_stations ? 'proven minimum' : `lower bound ${whole(best.lower_bound)}`);
  }
  if (best.fraction_of_achievable !== null) parts.push(`${percent(best.fraction_of_achievable)} coverage`);
  return parts.join(', ');
}
