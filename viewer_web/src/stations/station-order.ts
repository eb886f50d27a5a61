/** The figures of the stations' list, and the orders it can be read in. */
import type { PlanJson, PlanLink } from '../load/plan-json.ts';
import { type Counting, counts } from '../network/graph.ts';
import { lostM2 } from './losses.ts';
import type { ShownStation } from './shown.ts';

export type SortKey = 'order' | 'id' | 'sees' | 'adds' | 'links';

export interface StationRow {
  readonly station: ShownStation;
  /** Null: the plan does not know it. */
  readonly seesM2: number | null;
  readonly addsM2: number | null;
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
      seesM2: worth?.covered_area_m2 ?? null,
      addsM2: worth === undefined ? null : lostM2(plan, worth),
      nLinks: nLinks.get(station.id) ?? 0,
    };
  });
}

/** Order and id run upwards, figures from the largest down; equals in the order of the walk. */
export function sorted(rows: readonly StationRow[], key: SortKey): StationRow[] {
  const byWalk = (a: StationRow, b: StationRow): number => a.station.order - b.station.order;
  const figure = ({ seesM2, addsM2, nLinks }: StationRow): number =>
    (key === 'sees' ? seesM2 : key === 'adds' ? addsM2 : nLinks) ?? -1;
  return [...rows].sort((a, b) => {
    if (key === 'order') return byWalk(a, b);
    if (key === 'id') return a.station.id.localeCompare(b.station.id, 'en', { numeric: true });
    return figure(b) - figure(a) || byWalk(a, b);
  });
}
