/** Plans of different floors: which floors each is of, and which both are. */

import { isPlanned } from '../floors/planned.ts';
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';

/** What of a plan says which floors it is of. */
export type FloorsOfPlan = Pick<PlanJson, 'floors' | 'requirements'>;

/** The floors a plan is of, the lowest first. */
export function plannedFloors({ floors, requirements }: FloorsOfPlan): PlanJson['floors'] {
  return [...floors]
    .sort((a, b) => a.elevation_m - b.elevation_m)
    .filter((floor) => isPlanned(floor, requirements.floors));
}

/** Ids of the floors that both plans are of. */
export function commonFloors(a: FloorsOfPlan, b: FloorsOfPlan): Set<string> {
  const ofB = new Set(plannedFloors(b).map(({ id }) => id));
  return new Set(plannedFloors(a).flatMap(({ id }) => (ofB.has(id) ? [id] : [])));
}

/** One plan with the words it goes by: "The plan", "Run R001". */
export interface NamedPlan {
  readonly title: string;
  readonly plan: FloorsOfPlan;
}

/** What is compared where the plans are not of the same floors; null: they are. */
export function floorsInWords(shown: NamedPlan, other: NamedPlan): string | null {
  const both = commonFloors(shown.plan, other.plan);
  const isSame = [shown, other].every(({ plan }) => plannedFloors(plan).length === both.size);
  if (isSame) return null;
  const of = ({ title, plan }: NamedPlan): string =>
    t('{title} includes {names}', { title, names: listed(plannedFloors(plan).map(({ name }) => name)) });
  const names = plannedFloors(shown.plan).flatMap(({ id, name }) => (both.has(id) ? [name] : []));
  const what =
    names.length === 0
      ? t('No floor is in both: nothing is compared.')
      : t('Only {names} is compared.', { names: listed(names) });
  return `${of(shown)}; ${of(other)}. ${what}`;
}

function listed(names: readonly string[]): string {
  if (names.length < 2) return names[0] ?? t('no floor');
  return t('{names} and {last}', { names: names.slice(0, -1).join(', '), last: names[names.length - 1] });
}
