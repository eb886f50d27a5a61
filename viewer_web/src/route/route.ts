/** The crew's walk as lines on the ground: legs of plan.json, each point drawn with the floor it lies on. */
import type { PlanRoute } from '../load/plan-json.ts';
import type { StageFloor } from '../load/stage.ts';

/** Over the ground, so that the line is not in it. */
const ABOVE_GROUND_M = 0.04;
/** A point belongs to the highest floor not above it; landings lie a little lower than what they lead to. */
const SLACK_M = 0.6;

export interface RouteSegment {
  readonly leg: number;
  /** Local frame. */
  readonly fromM: readonly [number, number, number];
  readonly toM: readonly [number, number, number];
  /** Floors whose lift the ends are drawn with. */
  readonly fromFloor: string;
  readonly toFloor: string;
}

export function segmentsOf(
  route: PlanRoute,
  offsetM: readonly [number, number, number],
  floors: readonly StageFloor[],
): RouteSegment[] {
  const local = (point: readonly number[]): [number, number, number] => [
    point[0] - offsetM[0],
    point[1] - offsetM[1],
    point[2] - offsetM[2] + ABOVE_GROUND_M,
  ];
  return route.legs.flatMap(({ points, floors: ofLeg }, leg) => {
    const own = floors.filter(({ id }) => ofLeg.includes(id));
    const places = points.map(local);
    return places.slice(1).map((toM, i) => ({
      leg,
      fromM: places[i],
      toM,
      fromFloor: floorAt(places[i][2], own),
      toFloor: floorAt(toM[2], own),
    }));
  });
}

/** Of floors from the lowest up. */
function floorAt(heightM: number, floors: readonly StageFloor[]): string {
  const below = floors.filter(({ elevationM }) => elevationM <= heightM + SLACK_M);
  return (below[below.length - 1] ?? floors[0])?.id ?? '';
}

/** Whether the entrance that the draft's route was to begin at is not on ground that the plan reaches; null: the route of the plan. */
export function missesEntrance(draftRoute: PlanRoute | null, nEntrances: number): boolean {
  return draftRoute !== null && nEntrances > 0 && draftRoute.start === null;
}

/** What is said of the way to a stop. */
export interface Stop {
  readonly station: string;
  /** Leg that leads to it; null: the route starts there. */
  readonly leg: number | null;
  readonly from: string | null;
  /** Null: no way inside the model leads there. */
  readonly lengthM: number | null;
  readonly changesFloor: boolean;
}

/** The stations in route order. */
export function stopsOf({ order, legs }: PlanRoute): Stop[] {
  return order.map((station) => {
    const leg = legs.findIndex(({ to }) => to === station);
    if (leg < 0) return { station, leg: null, from: null, lengthM: 0, changesFloor: false };
    const { from, length_m, floors } = legs[leg];
    return { station, leg, from, lengthM: length_m, changesFloor: new Set(floors).size > 1 };
  });
}
