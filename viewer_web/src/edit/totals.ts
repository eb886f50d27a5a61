/** The totals of a draft beside those of its plan. */

import type { DraftFigures, PreviewHead } from '../api/documents.ts';
import { isPlanned } from '../floors/planned.ts';
import { decimal } from '../language/language.ts';
import type { PlanJson, RequirementResult } from '../load/plan-json.ts';
import { type Counting, countingOf, counts, type LinkFigures } from '../network/graph.ts';

export interface FloorTotal {
  readonly id: string;
  readonly name: string;
  readonly coverage: number;
  /** Its own share, or that of all. */
  readonly required: number;
  /** Null while a station is on its way. */
  readonly nStations: number | null;
}

/** One part of what was asked: fractions of its achievable area. */
export interface Met {
  readonly name: string;
  readonly required: number;
  readonly coverage: number;
  readonly isMet: boolean;
  /** What 99 of 100 set-ups within the tolerance cover at least; not computed of drafts. */
  readonly asSetUp?: number;
}

export interface Totals {
  readonly nStations: number;
  /** Fractions of the achievable area. */
  readonly coverage: number;
  /** Of all together. */
  readonly required: number;
  /** Those that the plan is of. */
  readonly floors: readonly FloorTotal[];
  /** What was asked, part by part, that of all last. */
  readonly requirements: readonly Met[];
  /** Floor that can't be reached on foot: nothing is planned there, and no share speaks of it. */
  readonly unreachableM2: number;
  /** Links that count; null while a station is on its way. */
  readonly nLinks: number | null;
  readonly nNetworks: number;
  /** That the stations register as one. */
  readonly isNetworkRequired: boolean;
  /** And survive the loss of any link. */
  readonly isRedundancyRequired: boolean;
  /** What is required of the network is not met. */
  readonly lacksNetwork: boolean;
}

export function planTotals(plan: PlanJson): Totals {
  const { coverage, registration, stations } = plan;
  return {
    nStations: stations.length,
    coverage: coverage.fraction_of_achievable,
    required: plan.requirements.coverage,
    unreachableM2: plan.sealed.reduce((sum, { area_m2 }) => sum + area_m2, 0),
    floors: floorTotals(plan, coverage.floors, stations),
    requirements: metOf(plan.requirements.results.length > 0 ? plan.requirements.results : [overall(plan)]),
    nLinks: countingLinks(registration.links, countingOf(plan)),
    ...networkOf(plan, registration.networks.length || (registration.connected ? 1 : stations.length), registration),
  };
}

export function draftTotals(plan: PlanJson, figures: DraftFigures): Totals {
  const { registration } = figures;
  const counting = countingOf(plan);
  return {
    nStations: figures.stations.length,
    coverage: figures.coverage.fraction_of_achievable,
    required: plan.requirements.coverage,
    unreachableM2: plan.sealed.reduce((sum, { area_m2 }) => sum + area_m2, 0),
    floors: floorTotals(plan, figures.floors, figures.stations),
    requirements: metOf(figures.requirements),
    nLinks: countingLinks(registration.links, { ...counting, threshold: registration.threshold ?? counting.threshold }),
    ...networkOf(plan, registration.networks.length, registration),
  };
}

/** While a station is on its way. */
export function previewTotals(plan: PlanJson, head: PreviewHead): Totals {
  return {
    nStations: head.n_stations,
    coverage: head.coverage.fraction_of_achievable,
    required: plan.requirements.coverage,
    unreachableM2: plan.sealed.reduce((sum, { area_m2 }) => sum + area_m2, 0),
    floors: floorTotals(plan, head.floors, null),
    requirements: metOf(head.requirements),
    nLinks: null,
    ...networkOf(plan, head.registration.n_networks, null),
  };
}

type NetworkTotals = Pick<Totals, 'nNetworks' | 'isNetworkRequired' | 'isRedundancyRequired' | 'lacksNetwork'>;
interface Networks {
  readonly networks: readonly { readonly stations: readonly string[]; readonly bridges: readonly unknown[] }[];
}

/** `found` null: whether single links hold the network together is not known. */
function networkOf({ requirements: { network } }: PlanJson, nNetworks: number, found: Networks | null): NetworkTotals {
  const isNetworkRequired = network !== 'none';
  const isRedundancyRequired = network === 'redundant' || network === 'loops';
  const hangs = found?.networks.some(({ stations, bridges }) => stations.length > 2 && bridges.length > 0) ?? false;
  return {
    nNetworks,
    isNetworkRequired,
    isRedundancyRequired,
    lacksNetwork: isNetworkRequired && (nNetworks > 1 || (isRedundancyRequired && hangs)),
  };
}

/** All that is required of the plan is met: surfaces, and the network. */
export const isAllMet = ({ requirements, lacksNetwork }: Totals): boolean =>
  missedOf(requirements).length === 0 && !lacksNetwork;

/** Links that can register two scans. */
export const countingLinks = (links: readonly LinkFigures[], counting: Counting): number =>
  links.filter((link) => counts(link, counting)).length;

/** What misses its coverage. */
export function missedOf(requirements: readonly Met[]): readonly Met[] {
  return requirements.filter(({ isMet }) => !isMet);
}

type StationsByFloor = readonly { readonly floor: string }[];
type Figures = readonly { readonly floor: string; readonly fraction_of_achievable: number }[];

function floorTotals(plan: PlanJson, figures: Figures, stations: StationsByFloor | null): FloorTotal[] {
  const planned = plan.floors.filter((floor) => isPlanned(floor, plan.requirements.floors));
  return figures.flatMap(({ floor: id, fraction_of_achievable: coverage }) => {
    const name = plan.floors.find((floor) => floor.id === id)?.name ?? id;
    if (!isPlanned({ id, name }, plan.requirements.floors)) return [];
    const nStations = stations?.filter(({ floor }) => floor === id).length ?? null;
    // The results begin with those of the planned floors, by the name or id that the client wrote.
    const own = plan.requirements.results[planned.findIndex((floor) => floor.id === id)];
    return [{ id, name, coverage, required: own?.required ?? plan.requirements.coverage, nStations }];
  });
}

function metOf(results: readonly RequirementResult[]): Met[] {
  return results.map(({ name, required, fraction_of_achievable, met, as_set_up }) => ({
    name,
    required,
    coverage: fraction_of_achievable,
    isMet: met,
    ...(typeof as_set_up === 'number' && { asSetUp: as_set_up }),
  }));
}

/** As plan.json names what is asked of everything together. */
export const OVERALL = 'overall';

/** Of plans that do not say it part by part. */
function overall({ coverage: { fraction_of_achievable }, requirements: { coverage: required } }: PlanJson) {
  return { name: OVERALL, required, fraction_of_achievable, met: fraction_of_achievable >= required };
}

/** "+2", "−1"; empty where nothing changed. */
export function signedCount(difference: number): string {
  return difference === 0 ? '' : `${difference > 0 ? '+' : '−'}${Math.abs(difference)}`;
}

/** "+0.4", "−1.2" percentage points; empty where less than a tenth changed. */
export function signedPoints(difference: number): string {
  const tenths = Math.round(1000 * difference);
  return tenths === 0 ? '' : `${tenths > 0 ? '+' : '−'}${decimal(Math.abs(tenths) / 10, 1)}`;
}
