/** Targets that register pairs of stations: where they hang, and for whom. */
import type { PlanJson } from '../load/plan-json.ts';
import type { Stop } from './route.ts';

export interface Target {
  /** Scene frame. */
  readonly positionM: readonly number[];
  /** Both stations that it is for. */
  readonly stationIds: readonly [string, string];
}

/** Of pairs one of whose stations is among the stops. */
export function targetsOf({ registration }: PlanJson, stops: readonly Stop[]): Target[] {
  const ids = new Set(stops.map(({ stationId }) => stationId));
  return registration.links
    .filter(({ a, b }) => ids.has(a) || ids.has(b))
    .flatMap(({ a, b, targets = [] }) => targets.map((positionM) => ({ positionM, stationIds: [a, b] as const })));
}

/** The other stations of a station's pairs. */
export function partnersOf(plan: PlanJson, stop: Stop): string[] {
  const others = targetsOf(plan, [stop]).map(({ stationIds: [a, b] }) => (a === stop.stationId ? b : a));
  return [...new Set(others)];
}
