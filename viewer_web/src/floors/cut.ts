/**
 * Which slices of the building are drawn, and where: all floors at once, one floor opened, or floors lifted apart.
 *
 * A slice is the part of the building between two heights, drawn higher by a lift. Everything in the scene (surfaces, lines,
 * clouds, markers, picks) goes through the same slices, so they always agree on what is visible.
 */
import type { Stage, StageFloor } from '../load/stage.ts';
import type { CutPlane } from '../section/planes.ts';

export interface Slice {
  /** Id of the floor it shows; null: the whole building. */
  readonly floorId: string | null;
  /** Local heights between which it shows, metres. */
  readonly bottomM: number;
  readonly topM: number;
  readonly liftM: number;
  /** Ceilings, roofs and all else that lies flat above this height is not drawn. */
  readonly ceilingM: number;
  /** What a section takes away of it besides. */
  readonly planes?: readonly CutPlane[];
}

export interface FloorView {
  /** Null: all floors. */
  readonly floorId: string | null;
  /** With all floors: each one opened and lifted off the one below. */
  readonly isSpread: boolean;
  /** Height of the cut above a floor's ground, metres. */
  readonly cutM: number;
  readonly hidesCeilings: boolean;
}

export interface Extent {
  readonly minM: readonly [number, number, number];
  readonly maxM: readonly [number, number, number];
}

export const WHOLE_BUILDING: Slice = {
  floorId: null,
  bottomM: Number.NEGATIVE_INFINITY,
  topM: Number.POSITIVE_INFINITY,
  liftM: 0,
  ceilingM: Number.POSITIVE_INFINITY,
};

/** Above furniture and door handles, below ceilings, and low enough to look into rooms. */
export const DEFAULT_CUT_M = 1.6;
export const LOWEST_CUT_M = 0.2;
/** So much below its ground belongs to a floor's picture: it lets the slab be seen as such. */
const SLAB_M = 0.3;
/** Faces at exactly the height of a cut would be drawn in shreds; hardly any lies this far off a round height. */
const OFF_FACES_M = 0.003;
/** What lies flat higher than this above the ground is no furniture any more. */
export const CEILING_M = 1.95;
/** More level than this is flat: roofs too, but not the flanks of a stair. */
export const FLAT_COS = 0.7;
/** Walls stand around a floor's ground. */
const WALL_M = 0.5;
/** Share of the building's shorter side by which a floor is lifted off the one below. */
const LIFT_SHARE = 0.85;

export function slicesOf(view: FloorView, floors: readonly StageFloor[], extent: Extent): Slice[] {
  const open = (floor: StageFloor, liftM: number): Slice => ({
    floorId: floor.id,
    bottomM: floor.elevationM - SLAB_M - OFF_FACES_M,
    topM: floor.elevationM + cutAbove(floor),
    liftM,
    ceilingM: ceilingOf(floor),
  });
  const ceilingOf = (floor: StageFloor): number =>
    view.hidesCeilings ? floor.elevationM + CEILING_M : Number.POSITIVE_INFINITY;
  const cutAbove = (floor: StageFloor): number => {
    if (view.cutM < highestCutM(floor)) return view.cutM + OFF_FACES_M;
    // Right below the ground of the floor above; over a highest floor nothing is cut.
    const isHighest = floors.every(({ elevationM }) => elevationM <= floor.elevationM);
    return highestCutM(floor) + (isHighest ? OFF_FACES_M : -OFF_FACES_M);
  };
  const chosen = floors.find((floor) => floor.id === view.floorId);
  if (chosen !== undefined) return [open(chosen, 0)];
  if (view.isSpread && floors.length > 0) {
    const shorterM = Math.min(extent.maxM[0] - extent.minM[0], extent.maxM[1] - extent.minM[1]);
    return floors.map((floor, i) => open(floor, i * LIFT_SHARE * shorterM));
  }
  const highest = floors[floors.length - 1];
  return [highest === undefined ? WHOLE_BUILDING : { ...WHOLE_BUILDING, ceilingM: ceilingOf(highest) }];
}

/** Up to the next floor's ground, or the building's highest point. */
export function highestCutM(floor: StageFloor): number {
  return Math.max(LOWEST_CUT_M, floor.topM - floor.elevationM);
}

/** The slice that a station of `floorId` is drawn with; undefined: not shown. */
export function sliceOfFloor(slices: readonly Slice[], floorId: string): Slice | undefined {
  return slices.find((slice) => slice.floorId === floorId || slice.floorId === null);
}

/** The box worth having in the picture: of an opened floor its ground, not the terrain or the eaves around it. */
export function extentOf(slices: readonly Slice[], extent: Extent, grounds: ReadonlyMap<string, Extent>): Extent {
  const min: [number, number, number] = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY];
  const max: [number, number, number] = [Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (const slice of slices) {
    const ground = slice.floorId === null ? undefined : grounds.get(slice.floorId);
    for (const axis of [0, 1]) {
      min[axis] = Math.min(min[axis], ground ? ground.minM[axis] - WALL_M : extent.minM[axis]);
      max[axis] = Math.max(max[axis], ground ? ground.maxM[axis] + WALL_M : extent.maxM[axis]);
    }
    min[2] = Math.min(min[2], Math.max(slice.bottomM, extent.minM[2]) + slice.liftM);
    max[2] = Math.max(max[2], Math.min(slice.topM, extent.maxM[2]) + slice.liftM);
  }
  return { minM: min, maxM: max };
}

/** Boxes of the whole building and of each floor's ground. */
export function extentsOf({ triangles, floors }: Pick<Stage, 'triangles' | 'floors'>): {
  whole: Extent;
  grounds: Map<string, Extent>;
} {
  const whole = growingExtent();
  const byFloor = new Map(floors.map((floor) => [floor.index + 1, { id: floor.id, extent: growingExtent() }]));
  for (let t = 0; t < triangles.count; t++) {
    const corners = triangles.cornersM.subarray(9 * t, 9 * t + 9);
    whole.add(corners);
    byFloor.get(triangles.groundOf[t])?.extent.add(corners);
  }
  const withGround = [...byFloor.values()].filter(({ extent }) => extent.minM[0] <= extent.maxM[0]);
  return { whole, grounds: new Map(withGround.map(({ id, extent }) => [id, extent])) };
}

function growingExtent() {
  const minM: [number, number, number] = [Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY];
  const maxM: [number, number, number] = [Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY, Number.NEGATIVE_INFINITY];
  const add = (corners: Float32Array): void => {
    for (let i = 0; i < corners.length; i++) {
      minM[i % 3] = Math.min(minM[i % 3], corners[i]);
      maxM[i % 3] = Math.max(maxM[i % 3], corners[i]);
    }
  };
  return { minM, maxM, add };
}

/** The next floor up (+1) or down (-1) in the order all, lowest ... highest; stays at the ends. */
export function floorBeside(floorId: string | null, step: number, floors: readonly StageFloor[]): string | null {
  const ids = [null, ...floors.map((floor) => floor.id)];
  const at = Math.max(0, ids.indexOf(floorId)) + step;
  return ids[Math.min(ids.length - 1, Math.max(0, at))];
}
