/** The figures of the stations' list, and the orders it can be read in. */
import type { PlanJson, PlanLink } from '../load/plan-json.ts';
import { type Counting, counts } from '../network/graph.ts';
import { lostM2 } from './losses.ts';
import type { ShownStation } from './shown.ts';

export type SortKey = 'order' | 'id' | 'seen' | 'lost' | 'links';

export interface StationRow {
  readonly station: ShownStation;
  /** Null: the plan does not know it. */
  readonly seenM2: number | null;
  readonly lostM2: number | null;
  readonly nLinks: number;
}

export function rowsOf(
  stations: readonly ShownStation[],
  plan: PlanJson,
  links: readonly PlanLink[],
  counting: Counting,
): StationRow[] {
  const planned = new Map(plan.stations.map((station) => [station.id, station]));
  const nLinks = new Map<string, number>();
  for (const link of links.filter((one) => counts(one, counting))) {
    for (const id of [link.a, link.b]) nLinks.set(id, (nLinks.get(id) ?? 0) + 1);
  }
  return stations.map((station) => {
    const worth = station.worth ?? planned.get(station.id);
    return {
      station,
      seenM2: worth?.covered_area_m2 ?? null,
      lostM2: worth === undefined ? null : lostM2(plan, worth),
      nLinks: nLinks.get(station.id) ?? 0,
    };
  });
}

/** Order and id run upwards, figures from the largest down; equals in route order. */
export function sorted(rows: readonly StationRow[], key: SortKey): StationRow[] {
  const byRoute = (a: StationRow, b: StationRow): number => a.station.order - b.station.order;
  const figure = ({ seenM2, lostM2, nLinks }: StationRow): number =>
    (key === 'seen' ? seenM2 : key === 'lost' ? lostM2 : nLinks) ?? -1;
  return [...rows].sort((a, b) => {
    if (key === 'order') return byRoute(a, b);
    if (key === 'id') return a.station.id.localeCompare(b.station.id, 'en', { numeric: true });
    return figure(b) - figure(a) || byRoute(a, b);
  });
}
