/** The route of the day: stop after stop, how far to the next, and which are done. */
import type { DraftStation } from '../edit/draft.ts';
import type { PlanJson } from '../load/plan-json.ts';

export interface Stop {
  readonly stationId: string;
  /** As it is marked. */
  readonly number: number;
  readonly floorId: string;
  readonly floorName: string;
  /** Of the sensor; null: not known. */
  readonly heightM: number | null;
  /** Scene frame. */
  readonly positionM: readonly [number, number, number];
  /** The way from the stop before, or from where the route starts; null: no way inside the model, or not known, as where an end was edited. */
  readonly wayM: number | null;
  /** Corners of that way on the ground, scene frame. */
  readonly way: readonly (readonly [number, number, number])[];
  /** No way inside the model leads to it. */
  readonly isWithoutWay: boolean;
}

/** The stations in the order of visits, as the review has them. */
export function routeStops(plan: PlanJson, stations: readonly DraftStation[]): Stop[] {
  const kept = stations.filter(({ isRemoved }) => !isRemoved);
  const edited = new Set(kept.filter(({ isAdded, movedFromM }) => isAdded || movedFromM !== null).map(({ id }) => id));
  return kept.map((station, i): Stop => {
    const before = i === 0 ? null : kept[i - 1].id;
    const isEdited = edited.has(station.id) || (before !== null && edited.has(before));
    const leg = isEdited ? undefined : plan.route?.legs.find(({ from, to }) => to === station.id && from === before);
    return {
      stationId: station.id,
      number: station.number,
      floorId: station.floorId,
      floorName: plan.floors.find(({ id }) => id === station.floorId)?.name ?? station.floorId,
      heightM: station.instrumentHeightM,
      positionM: station.positionM,
      wayM: leg?.length_m ?? null,
      way: leg?.points ?? [],
      isWithoutWay: leg === undefined ? (plan.route?.left_out.includes(station.id) ?? false) : leg.length_m === null,
    };
  });
}

/** The first stop that is not done; null: all are. */
export function nextStop(stops: readonly Stop[], done: ReadonlySet<string>): Stop | null {
  return stops.find(({ stationId }) => !done.has(stationId)) ?? null;
}

/** Place in `stops` of the first one to walk to on the way to place `at`: after the last stop before it that is done. */
function firstToWalkTo(at: number, stops: readonly Stop[], done: ReadonlySet<string>): number {
  let from = at - 1;
  while (from >= 0 && !done.has(stops[from].stationId)) from--;
  return from + 1;
}

/**
 * How far it is along the route to `stop`, from the last stop before it that is done; from where the route starts where none is.
 * Null: not known.
 */
export function wayTo(stop: Stop, stops: readonly Stop[], done: ReadonlySet<string>): number | null {
  const at = stops.indexOf(stop);
  const ways = stops.slice(firstToWalkTo(at, stops, done), at + 1).map(({ wayM }) => wayM);
  return ways.some((way) => way === null) ? null : ways.reduce((sum: number, way) => sum + (way ?? 0), 0);
}

/** What is left to walk. */
export interface WayLeft {
  readonly lengthM: number;
  /** Legs that it leaves out. */
  readonly nWithoutWay: number;
}

/** Over the stops that are left, and from the last one to where the route ends. */
export function wayLeft({ route }: PlanJson, stops: readonly Stop[], done: ReadonlySet<string>): WayLeft {
  const next = nextStop(stops, done);
  if (next === null) return { lengthM: 0, nWithoutWay: 0 };
  const rest = stops.slice(firstToWalkTo(stops.indexOf(next), stops, done));
  const last = route?.legs.at(-1);
  const back = last !== undefined && (route?.returns || last.to === null) ? [last] : [];
  return {
    lengthM: [...rest.map(({ wayM }) => wayM), ...back.map(({ length_m }) => length_m)].reduce(
      (sum: number, wayM) => sum + (wayM ?? 0),
      0,
    ),
    nWithoutWay:
      rest.filter(({ isWithoutWay }) => isWithoutWay).length + back.filter(({ length_m }) => length_m === null).length,
  };
}
