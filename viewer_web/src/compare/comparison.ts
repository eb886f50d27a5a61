/** Another plan to hold the shown one against: its figures, its coverage by patch, its stations. */

import type { FloorTotal, Totals } from '../edit/totals.ts';
import { withinScope } from '../heat/scope.ts';
import { t } from '../language/language.ts';
import { fetchBytes, fetchScope } from '../load/fetch-plan.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { type PlanJson, parsePlan } from '../load/plan-json.ts';
import { reachedPercent } from '../panels/figures.ts';

export interface OtherPlan {
  readonly base: string;
  readonly title: string;
  readonly plan: PlanJson;
  /** As `LoadedPlan.patchSeen`. */
  readonly patchSeen: Uint8Array;
}

/** "The plan", "Run R001". */
export function titleOfBase(base: string): string {
  if (base === OWN_PLAN) return t('The plan');
  const run = base.match(/^runs\/([^/]+)\/plan$/);
  return run === null ? base : t('Run {id}', { id: run[1] });
}

export async function fetchOtherPlan(base: string, signal: AbortSignal): Promise<OtherPlan> {
  const [planBytes, patchBytes] = await Promise.all(
    ['plan.json', 'viewer/patches.u8'].map((path) => fetchBytes(base, path, undefined, signal)),
  );
  const plan = parsePlan(JSON.parse(new TextDecoder().decode(planBytes)));
  const scope = await fetchScope(base, plan, patchBytes.byteLength, signal);
  return { base, title: titleOfBase(base), plan, patchSeen: withinScope(new Uint8Array(patchBytes), scope) };
}

/** Leaves of open doors are left out: patches of plans with other doors are not each other's. */
export function hasSameDoors(one: PlanJson, other: PlanJson): boolean {
  const told = ({ scene: { doors, load_options } }: PlanJson): string =>
    JSON.stringify([
      doors,
      ...[load_options?.doors_open, load_options?.doors_shut].map((ids) => [...(ids ?? [])].sort()),
    ]);
  return told(one) === told(other);
}

/** Coverage by number of stations, the station that adds most first, as far as the plan says it so. */
export function steepestCurve({ why, coverage_curve }: PlanJson): readonly (number | null)[] {
  return why === null ? coverage_curve : why.curve.map(({ fraction_of_achievable }) => fraction_of_achievable);
}

export interface FigureRow {
  readonly name: string;
  readonly shown: string;
  readonly other: string;
}

interface Compared {
  readonly nStations: number;
  readonly coverage: number;
  /** Of all together. */
  readonly required: number;
  readonly floors: Totals['floors'];
  readonly nLinks: number | null;
  readonly nNetworks: number;
}

/** Figures side by side, floor by floor where either has several; of plans of different floors none of all together. */
export function figureRows(shown: Compared, other: Compared): FigureRow[] {
  const percent = (of: Pick<FloorTotal, 'coverage' | 'required'> | undefined): string =>
    of === undefined ? t('not planned') : reachedPercent(of.coverage, of.required);
  const row = (name: string, read: (of: Compared) => string): FigureRow => ({
    name,
    shown: read(shown),
    other: read(other),
  });
  const floors = [...shown.floors, ...other.floors.filter(({ id }) => shown.floors.every((floor) => floor.id !== id))];
  const isSame = [shown, other].every((each) => each.floors.length === floors.length);
  const on = (of: Compared, id: string): FloorTotal | undefined => of.floors.find((floor) => floor.id === id);
  const stations = (n: number | null | undefined): string => (n === undefined ? t('not planned') : String(n ?? ''));
  return [
    row(t('Stations'), ({ nStations }) => String(nStations)),
    ...(isSame ? [] : floors).map(({ id, name }) => row(`– ${name}`, (of) => stations(on(of, id)?.nStations))),
    ...(isSame ? [row(t('Coverage'), percent)] : []),
    ...(floors.length > 1 ? floors : []).map(({ id, name }) =>
      row(isSame ? name : t('Coverage, {name}', { name }), (of) => percent(on(of, id))),
    ),
    row(t('Links'), ({ nLinks }) => (nLinks === null ? '' : String(nLinks))),
    row(t('Connected groups'), ({ nNetworks }) => String(nNetworks)),
  ];
}
