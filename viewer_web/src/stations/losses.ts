/**
 * What the plan would lose against its requirements if a station went, as the plan folder and the live side tell it:
 * surface that no other station sees well enough, or that too few do.
 */

import { OVERALL } from '../edit/totals.ts';
import { t } from '../language/language.ts';
import type { PlanJson, RequirementResult, StationLoss } from '../load/plan-json.ts';
import { askedPercent, reachedPercent } from '../panels/figures.ts';
import type { StationWorth } from './shown.ts';

/** Whether anything is asked besides that a station sees the surface: limits, several stations, or limits of a part. */
export function asksMore({ requirements: { asked, seen_from: seenFrom = 1, parts = [] } }: PlanJson): boolean {
  return seenFrom > 1 || parts.length > 0 || Object.values(asked ?? {}).some((limit) => limit !== null);
}

/** Area that the plan would lose; plans of older versions know only what goes of the surface that is asked of all. */
export function lostM2(plan: PlanJson, worth: StationWorth): number {
  return (asksMore(plan) ? worth.lost_area_m2 : null) ?? worth.own_area_m2;
}

export interface LossWords {
  readonly name: string;
  readonly hint: string;
  readonly highlight: string;
}

/** Only where seeing is all that is asked is it what nobody else sees; the words must not say so of other plans. */
export function lossWords(plan: PlanJson): LossWords {
  if (!asksMore(plan)) {
    return {
      name: t('Unique area'),
      hint: t('Area that no other station of the plan sees'),
      highlight: t('Highlight unique area'),
    };
  }
  return {
    name: t('Lost if removed'),
    hint: t(
      'Area that no longer meets the requirements without this station: no other sees it well enough, or too few do',
    ),
    highlight: t('Highlight area lost if removed'),
  };
}

/** What the legend says of the marked surface. */
export function lossLegend(plan: PlanJson, stationId: string, requirement: string | null): string {
  if (!asksMore(plan)) return t('Unique area of {id}', { id: stationId });
  return requirement === null
    ? t('Lost without {id}', { id: stationId })
    : t('{requirement}: lost without {id}', { requirement: requirementName(requirement), id: stationId });
}

/** As the table of the plan names it. */
export const requirementName = (name: string): string => (name === OVERALL ? t('Whole building') : name);

/** What becomes of a requirement without the station. */
export function verdictOf(
  { fraction_of_achievable: left, met }: StationLoss,
  now: Readonly<RequirementResult>,
): string {
  const words = met ? t('still met') : now.met ? t('no longer met') : t('not met either way');
  return `${words}: ${reachedPercent(left, now.required)}, ${t('{required} required', { required: askedPercent(now.required) })}`;
}

/** Patches by requirement, in the plan's order, of a file below viewer/lost: see docs/formats/stage.md. Null: it is none. */
export function parseLost(bytes: ArrayBuffer, nRequirements: number): readonly Uint32Array[] | null {
  if (bytes.byteLength % 4 !== 0 || bytes.byteLength < 4 * nRequirements) return null;
  const numbers = new Uint32Array(bytes);
  const lost: Uint32Array[] = [];
  let at = nRequirements;
  for (const size of numbers.subarray(0, nRequirements)) {
    lost.push(numbers.subarray(at, at + size));
    at += size;
  }
  return at === numbers.length ? lost : null;
}
