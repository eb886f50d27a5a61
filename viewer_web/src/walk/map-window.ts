/** What of a floor the map of a walk shows, and which floor that is. */
import type { Extent } from '../floors/cut.ts';
import type { StageFloor } from '../load/stage.ts';

/** Of a larger floor the map shows what is around the person who walks. */
const WIDEST_M = 36;
/** Walls stand around a floor's ground. */
const WALL_M = 0.8;
/** On the last steps up to it one is on the upper floor. */
const NEARLY_UP_M = 0.4;

export interface MapWindow {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** Local frame, y turned round as in a drawing. */
export function mapWindow({ minM, maxM }: Extent, eyeM: readonly number[]): MapWindow {
  const [x, width] = along(minM[0] - WALL_M, maxM[0] + WALL_M, eyeM[0]);
  const [y, height] = along(-maxM[1] - WALL_M, -minM[1] + WALL_M, -eyeM[1]);
  return { x, y, width, height };
}

/** Where the part of a side that is shown begins, and its length; beyond the ends of a floor nothing is. */
function along(from: number, to: number, at: number): [number, number] {
  const length = Math.min(WIDEST_M, to - from);
  return [Math.max(from, Math.min(to - length, at - length / 2)), length];
}

/** Where no floor's ground is below the feet, as on a table or a sill: the highest floor that is not above them. */
export function floorAt(feetM: number, floors: readonly StageFloor[]): StageFloor | undefined {
  const reached = floors.filter(({ elevationM }) => elevationM <= feetM + NEARLY_UP_M);
  return reached.reduce((a, b) => (b.elevationM > a.elevationM ? b : a), reached[0] ?? floors[0]);
}
