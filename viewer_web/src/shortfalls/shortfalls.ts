/** What the coverage figure does not say: ground that nobody can reach, requirements that are not met, groups that do not register. */

import { missedOf, type Totals } from '../edit/totals.ts';
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { areaWords, counted } from '../panels/figures.ts';
import { missedInWords } from '../panels/requirements.tsx';

export interface SealedPlace {
  readonly floorId: string;
  readonly areaM2: number;
  /** On the ground, scene frame. */
  readonly insideM: readonly [number, number, number];
  /** Its ground in plan, lowest and highest (x, y), scene frame; plans of older versions have none. */
  readonly rectangles: readonly (readonly [readonly [number, number], readonly [number, number]])[];
}

/** Of the surface in scope, and of the surface that counts: as in coverage/percent.py. */
const LARGE_SHARE = 1 / 3;
const MISSED_SHARE = 0.1;
/** Of surface that valid positions see, but none as required. */
const NOT_AS_REQUIRED = {
  'too few spots see it': true,
  'out of range': true,
  'too oblique': true,
  'too sparse': true,
  'too noisy': true,
} as const;

export type Shortfall =
  | { readonly kind: 'unreachable'; readonly words: string; readonly places: readonly SealedPlace[] }
  | { readonly kind: 'unscannable'; readonly words: string }
  | { readonly kind: 'requirement'; readonly words: string; readonly name: string }
  | { readonly kind: 'groups'; readonly words: string };

/** The worst first: what is not planned at all, then what is not met, then what does not register. */
export function shortfallsOf(plan: PlanJson, { requirements, nNetworks }: Totals): readonly Shortfall[] {
  const places = sealedPlaces(plan);
  const found: Shortfall[] = missedOf(requirements).map((met) => ({
    kind: 'requirement',
    words: t('Not met: {requirements}', { requirements: missedInWords([met]) }),
    name: met.name,
  }));
  const { achievable_area_m2: scannableM2, total_area_m2: totalM2 } = plan.coverage;
  // The inside of walls is in the total where all of the model is in scope.
  const isScoped = plan.scope !== null && plan.scope.kind !== 'all';
  const missedM2 = notAsRequiredM2(plan);
  const hiddenM2 = totalM2 - scannableM2 - missedM2;
  if (isScoped && hiddenM2 > LARGE_SHARE * totalM2)
    found.unshift({
      kind: 'unscannable',
      words: t('Not scannable: {area} of {total} in scope, from no valid tripod position', {
        area: areaWords(hiddenM2),
        total: areaWords(totalM2),
      }),
    });
  if (missedM2 > 0)
    found.unshift({
      kind: 'unscannable',
      words: t('Not scannable as required: {area} that valid positions see, beside the {counted} that count', {
        area: areaWords(missedM2),
        counted: areaWords(scannableM2),
      }),
    });
  if (places.length > 0) {
    const areaM2 = places.reduce((sum, place) => sum + place.areaM2, 0);
    const where = places.length === 1 ? t('one area') : counted(places.length, 'area');
    found.unshift({
      kind: 'unreachable',
      words: t('Not planned: {area} of floor that can’t be reached on foot, in {where}', {
        area: areaWords(areaM2),
        where,
      }),
      places,
    });
  }
  if (nNetworks > 1 && isJoined(plan))
    found.push({ kind: 'groups', words: t('{n} unconnected groups', { n: nNetworks }) });
  return found;
}

/** 0 where it is little. */
function notAsRequiredM2({ why, coverage }: PlanJson): number {
  const missedM2 = Object.keys(NOT_AS_REQUIRED).reduce((sum, reason) => sum + (why?.area_by_reason_m2[reason] ?? 0), 0);
  return missedM2 > MISSED_SHARE * coverage.achievable_area_m2 ? missedM2 : 0;
}

/** Largest first. */
export function sealedPlaces({ sealed }: PlanJson): readonly SealedPlace[] {
  return sealed
    .map(({ floor, area_m2, inside, rectangles }) => ({
      floorId: floor,
      areaM2: area_m2,
      insideM: inside,
      rectangles,
    }))
    .sort((a, b) => b.areaM2 - a.areaM2);
}

/** Whether all stations are to be connected. */
const isJoined = ({ requirements: { network, overlap, min_probability: probability } }: PlanJson): boolean =>
  network !== 'none' && (overlap > 0 || probability > 0);
