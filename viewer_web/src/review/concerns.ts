/** What speaks against carrying the plan out as it stands: asked about before somebody signs it off. */

import type { Review } from '../api/documents.ts';
import type { DraftStation } from '../edit/draft.ts';
import type { Place } from '../edit/ground-map.ts';
import { isInside } from '../edit/outline.ts';
import { missedOf } from '../edit/totals.ts';
import type { TotalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import { missedInWords } from '../panels/requirements.tsx';

export interface Concern {
  readonly kind: 'unknown' | 'requirement' | 'network' | 'kept_out' | 'rejected' | 'comment';
  readonly words: string;
}

interface UnderReview {
  readonly review: Review;
  /** All of the review's, those it removes among them. */
  readonly stations: readonly DraftStation[];
  readonly totals: TotalsBeside;
}

/** The gravest first. */
export function concernsOf({ review, stations, totals }: UnderReview): Concern[] {
  const left = stations.filter(({ isRemoved }) => !isRemoved);
  return [
    ...figureConcerns(totals),
    ...listed(
      'kept_out',
      keptOutStations(review, left),
      t('is in a keep-out zone or at a forbidden position'),
      t('are in keep-out zones or at forbidden positions'),
    ),
    ...listed(
      'rejected',
      rejectedStations(review, left),
      t('is rejected and still in the plan'),
      t('are rejected and still in the plan'),
    ),
    ...commentConcerns(review),
  ];
}

function figureConcerns({ planned, isEdited, edited, isStale }: TotalsBeside): Concern[] {
  const known = isEdited ? edited : planned;
  if (known === null) {
    return [{ kind: 'unknown', words: t('Coverage of the edited plan unknown: live editing is off') }];
  }
  const concerns: Concern[] = [];
  if (isStale) concerns.push({ kind: 'unknown', words: t('Figures of the last changes are still being computed') });
  if (missedOf(known.requirements).length > 0) {
    concerns.push({
      kind: 'requirement',
      words: t('Not met: {requirements}', { requirements: missedInWords(known.requirements) }),
    });
  }
  if (known.lacksNetwork) {
    const words =
      known.nNetworks > 1
        ? t('Network in {n} unconnected groups, required: connected', { n: known.nNetworks })
        : t('Network held together by single links, required: redundant');
    concerns.push({ kind: 'network', words });
  }
  return concerns;
}

function listed(kind: Concern['kind'], ids: readonly string[], one: string, many: string): Concern[] {
  return ids.length === 0 ? [] : [{ kind, words: `${ids.join(', ')} ${ids.length === 1 ? one : many}` }];
}

/** Stations in a keep-out area or a forbidden place of their floor, or of all floors. */
export function keptOutStations(review: Review, stations: readonly DraftStation[]): string[] {
  const zones = Object.values(review.zones).filter(({ kind }) => kind === 'keep_out');
  const forbidden = Object.values(review.forbidden);
  const isOn = (floor: string, { floorId }: DraftStation): boolean => floor === '' || floor === floorId;
  return stations.flatMap((station) => {
    const [x, y] = station.positionM;
    const isKeptOut =
      zones.some(({ floor, outline_m }) => isOn(floor, station) && isInside(outline_m as readonly Place[], [x, y])) ||
      forbidden.some(
        ({ floor, position_m, radius_m }) =>
          isOn(floor, station) && Math.hypot(position_m[0] - x, position_m[1] - y) < radius_m,
      );
    return isKeptOut ? [station.id] : [];
  });
}

function rejectedStations({ verdicts }: Review, stations: readonly DraftStation[]): string[] {
  return stations.flatMap(({ id }) => (verdicts[id]?.verdict === 'rejected' ? [id] : []));
}

function commentConcerns({ comments }: Review): Concern[] {
  const nOpen = Object.values(comments).filter(({ resolved }) => !resolved).length;
  return nOpen === 0
    ? []
    : [{ kind: 'comment', words: t('{n, plural, one {# comment is open} other {# comments are open}}', { n: nOpen }) }];
}
