/** Where one more station is tried that might join groups: tripod positions near two of them, best first. */
import type { Point } from '../api/documents.ts';
import { GROUND, type GroundMap } from '../edit/ground-map.ts';

export interface JoinPlace {
  readonly floorId: string;
  readonly positionM: Point;
  readonly heightM: number;
}

export interface JoinStation {
  readonly id: string;
  readonly positionM: readonly [number, number, number];
}

export interface JoinFloor {
  readonly ground: GroundMap;
  readonly elevationM: number;
  /** Of the instrument. */
  readonly heightM: number;
}

/** Positions are tried this far apart. */
const STEP_M = 1;
/** Of every two groups, and of all. */
const MOST_OF_PAIR = 10;
const MOST = 60;

/** All in one frame, metres. Each two groups have their turn, from the place that is nearest to both on. */
export function joinPlaces(
  groups: readonly (readonly JoinStation[])[],
  floors: readonly JoinFloor[],
): readonly JoinPlace[] {
  const byPair = new Map<string, { readonly place: JoinPlace; readonly awayM: number }[]>();
  for (const floor of floors) {
    for (const place of placesOn(floor)) {
      const nearest = groups
        .map((stations, group) => ({ group, awayM: Math.min(...stations.map((one) => away(place, one))) }))
        .sort((a, b) => a.awayM - b.awayM);
      if (nearest.length < 2) return [];
      const [first, second] = nearest;
      const pair = [first.group, second.group].sort((a, b) => a - b).join();
      const ofPair = byPair.get(pair) ?? [];
      // From amidst both, each sees most of what the place sees.
      ofPair.push({ place, awayM: second.awayM + first.awayM / 2 });
      byPair.set(pair, ofPair);
    }
  }
  const lists = [...byPair.values()].map((found) => found.sort((a, b) => a.awayM - b.awayM).slice(0, MOST_OF_PAIR));
  lists.sort((a, b) => a[0].awayM - b[0].awayM);
  const turns = [...Array(MOST_OF_PAIR).keys()].flatMap((turn) => lists.flatMap((list) => list[turn] ?? []));
  return turns.slice(0, MOST).map(({ place }) => place);
}

const away = ({ positionM }: JoinPlace, station: JoinStation): number =>
  Math.hypot(...positionM.map((value, k) => value - station.positionM[k]));

/** One admissible cell of each square of `STEP_M`. */
function placesOn({ ground, elevationM, heightM }: JoinFloor): JoinPlace[] {
  const { origin, cell_m: cellM, width, height } = ground.head;
  const step = Math.max(1, Math.round(STEP_M / cellM));
  const places: JoinPlace[] = [];
  for (let row = 0; row < height; row += step) {
    for (let column = 0; column < width; column += step) {
      const cell = firstIn(ground, column, row, step);
      if (cell === null) continue;
      const [x, y] = cell.map((index, k) => origin[k] + (index + 0.5) * cellM);
      places.push({ floorId: ground.floorId, positionM: [x, y, elevationM + heightM], heightM });
    }
  }
  return places;
}

function firstIn({ head, values }: GroundMap, column: number, row: number, step: number): [number, number] | null {
  for (let r = row; r < Math.min(row + step, head.height); r++) {
    for (let c = column; c < Math.min(column + step, head.width); c++)
      if (values[r * head.width + c] === GROUND.admissible) return [c, r];
  }
  return null;
}
