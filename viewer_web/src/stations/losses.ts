/**
 * What the plan would lose against its requirements if a station went, as the plan folder and the live side tell it:
 * surface that no other station sees well enough, or that too few do.
 */
import { OVERALL } from '../edit/totals.ts';
import type { PlanJson, RequirementResult, StationLoss } from '../load/plan-json.ts';
import { askedPercent, coveragePercent } from '../panels/figures.ts';
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
      name: 'Unique area',
      hint: 'Area that no other station of the plan sees',
      highlight: 'Highlight unique area',
    };
  }
  return {
    name: 'Lost if removed',
    hint: 'Area that no longer meets the requirements without this station: no other sees it well enough, or too few do',
    highlight: 'Highlight area lost if removed',
  };
}

/** What the legend says of the marked surface. */
export function lossLegend(plan: PlanJson, stationId: string, requirement: string | null): string {
  if (!asksMore(plan)) return `Unique area of ${stationId}`;
  return `${requirement === null ? 'Lost' : `${requirementName(requirement)}: lost`} without ${stationId}`;
}

/** As the table of the plan names it. */
export const requirementName = (name: string): string => (name === OVERALL ? 'Whole building' : name);

/** What becomes of a requirement without the station. */
export function verdictOf(
  { fraction_of_achievable: left, met }: StationLoss,
  now: Readonly<RequirementResult>,
): string {
  const words = met ? 'still met' : now.met ? 'no longer met' : 'not met either way';
  return `${words}: ${coveragePercent(left, now.required)}, ${askedPercent(now.required)} required`;
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
