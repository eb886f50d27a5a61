/** The totals of a draft beside those of its plan. */
import type { DraftFigures, PreviewHead } from '../api/documents.ts';
import type { PlanJson } from '../load/plan-json.ts';

export interface Totals {
  readonly nStations: number;
  /** Fractions of the achievable area. */
  readonly coverage: number;
  readonly floors: readonly { readonly id: string; readonly name: string; readonly coverage: number }[];
  /** Links that count; null while a station is on its way. */
  readonly nLinks: number | null;
  readonly nNetworks: number;
}

export function planTotals(plan: PlanJson): Totals {
  const { coverage, registration, stations } = plan;
  return {
    nStations: stations.length,
    coverage: coverage.fraction_of_achievable,
    floors: coverage.floors.map((floor) => named(plan, floor.floor, floor.fraction_of_achievable)),
    nLinks: countingLinks(registration.links, registration.threshold, registration.min_strength ?? 0),
    nNetworks: registration.networks.length || (registration.connected ? 1 : stations.length),
  };
}

export function draftTotals(plan: PlanJson, figures: DraftFigures): Totals {
  const { registration } = figures;
  const threshold = registration.threshold ?? plan.registration.threshold;
  return {
    nStations: figures.stations.length,
    coverage: figures.coverage.fraction_of_achievable,
    floors: figures.floors.map((floor) => named(plan, floor.floor, floor.fraction_of_achievable)),
    nLinks: countingLinks(registration.links, threshold, plan.registration.min_strength ?? 0),
    nNetworks: registration.networks.length,
  };
}

/** While a station is on its way. */
export function previewTotals(plan: PlanJson, head: PreviewHead): Totals {
  return {
    nStations: head.n_stations,
    coverage: head.coverage.fraction_of_achievable,
    floors: head.floors.map((floor) => named(plan, floor.floor, floor.fraction_of_achievable)),
    nLinks: null,
    nNetworks: head.registration.n_networks,
  };
}

/** Links that can register two scans: enough overlap, and strong enough where strength is known. */
export function countingLinks(
  links: readonly { readonly overlap: number; readonly strength: number | null }[],
  threshold: number,
  minStrength: number,
): number {
  return links.filter(({ overlap, strength }) => overlap >= threshold && (strength ?? 1) >= minStrength).length;
}

function named(plan: PlanJson, id: string, coverage: number): { id: string; name: string; coverage: number } {
  return { id, name: plan.floors.find((floor) => floor.id === id)?.name ?? id, coverage };
}

/** "+2", "−1"; empty where nothing changed. */
export function signedCount(difference: number): string {
  return difference === 0 ? '' : `${difference > 0 ? '+' : '−'}${Math.abs(difference)}`;
}

/** "+0.4", "−1.2" percentage points; empty where less than a tenth changed. */
export function signedPoints(difference: number): string {
  const tenths = Math.round(1000 * difference);
  return tenths === 0 ? '' : `${tenths > 0 ? '+' : '−'}${(Math.abs(tenths) / 10).toFixed(1)}`;
}
