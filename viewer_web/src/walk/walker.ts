/** Walking at eye height: one step of a person who stays on the ground and does not pass through walls. Metres, z up. */

export interface WalkPose {
  readonly eyeM: readonly [number, number, number];
  /** Counterclockwise from +x. */
  readonly headingRad: number;
  /** Upwards from level. */
  readonly pitchRad: number;
  /** Of the eye above the ground. */
  readonly eyeHeightM: number;
}

/** What is asked, each -1 ... 1. */
export interface WalkInput {
  readonly forward: number;
  readonly right: number;
  /** To the left. */
  readonly turn: number;
  readonly isFast: boolean;
}

/** Ground of a floor. */
export interface WalkGround {
  readonly heightM: number;
  readonly floorId: string;
}

export interface WalkWorld {
  /** Height of the highest surface at or below a point; null: none within `depthM`. */
  groundBelow(x: number, y: number, z: number, depthM: number): number | null;
  /** How far one gets from a point in a level direction before something is met. */
  /** The ground of a floor below a point; null: something else comes first, or nothing within `depthM`. */
  floorBelow(x: number, y: number, z: number, depthM: number): WalkGround | null;
  freeAhead(from: readonly [number, number, number], direction: readonly [number, number]): number;
}

export const DEFAULT_EYE_HEIGHT_M = 1.65;
const WALK_M_PER_S = 1.6;
const RUN_FACTOR = 2.5;
const TURN_RAD_PER_S = 1.6;
/** Half of a person's width. */
const RADIUS_M = 0.25;
/** Higher than this one does not step up, deeper than that one does not step down. */
const STEP_UP_M = 0.35;
const STEP_DOWN_M = 0.6;
const STEEPEST_PITCH_RAD = 1.4;

/** What hits the body: at the knee above what can be stepped on, and at the chest. */
const BODY_SHARES = [0.35, 0.8];
/** All around a body. */
const DIRECTIONS = [...Array(8).keys()].map((i): [number, number] => [
  Math.cos((i * Math.PI) / 4),
  Math.sin((i * Math.PI) / 4),
]);

export function turned(pose: WalkPose, headingBy: number, pitchBy: number): WalkPose {
  const pitchRad = Math.max(-STEEPEST_PITCH_RAD, Math.min(STEEPEST_PITCH_RAD, pose.pitchRad + pitchBy));
  return { ...pose, headingRad: pose.headingRad + headingBy, pitchRad };
}

/** Where the eye looks: one metre ahead. */
export function targetOf({ eyeM: [x, y, z], headingRad, pitchRad }: WalkPose): [number, number, number] {
  const flat = Math.cos(pitchRad);
  return [x + flat * Math.cos(headingRad), y + flat * Math.sin(headingRad), z + Math.sin(pitchRad)];
}

/** The pose after `seconds`; along a wall it slides. */
export function step(pose: WalkPose, input: WalkInput, seconds: number, world: WalkWorld): WalkPose {
  const facing = turned(pose, input.turn * TURN_RAD_PER_S * seconds, 0);
  const length = Math.hypot(input.forward, input.right);
  if (length === 0) return facing;
  const far = (WALK_M_PER_S * (input.isFast ? RUN_FACTOR : 1) * seconds) / Math.max(1, length);
  const [sin, cos] = [Math.sin(facing.headingRad), Math.cos(facing.headingRad)];
  const move: [number, number] = [
    far * (input.forward * cos + input.right * sin),
    far * (input.forward * sin - input.right * cos),
  ];
  const tries: [number, number][] = [move, [move[0], 0], [0, move[1]]];
  for (const [dx, dy] of tries) {
    const moved = movedBy(facing, dx, dy, world);
    if (moved !== null) return moved;
  }
  return facing;
}

/** The pose on the ground at a place; null: nobody stands there. */
export function standing(pose: WalkPose, x: number, y: number, world: WalkWorld): WalkPose | null {
  const feet = pose.eyeM[2] - pose.eyeHeightM;
  const ground = world.groundBelow(x, y, feet + STEP_UP_M, STEP_UP_M + STEP_DOWN_M);
  return ground === null ? null : { ...pose, eyeM: [x, y, ground + pose.eyeHeightM] };
}

/** The pose at a place of a floor's map, where a person has room: on its ground, and in no wall; null: nobody stands there. */
export function standingOnMap(pose: WalkPose, x: number, y: number, floorM: number, world: WalkWorld): WalkPose | null {
  const { eyeHeightM } = pose;
  const ground = world.floorBelow(x, y, floorM + eyeHeightM, eyeHeightM + STEP_DOWN_M);
  if (ground === null) return null;
  const there: WalkPose = { ...pose, eyeM: [x, y, ground.heightM + eyeHeightM] };
  const isFree = DIRECTIONS.every((direction) =>
    bodyHeights(there).every((z) => world.freeAhead([x, y, z], direction) >= RADIUS_M),
  );
  return isFree ? there : null;
}

/** At which heights something hits the body. */
function bodyHeights({ eyeM, eyeHeightM }: WalkPose): number[] {
  return BODY_SHARES.map((share) => eyeM[2] - eyeHeightM + Math.max(STEP_UP_M + 0.05, share * eyeHeightM));
}

function movedBy(pose: WalkPose, dx: number, dy: number, world: WalkWorld): WalkPose | null {
  const far = Math.hypot(dx, dy);
  if (far < 1e-6) return null;
  const [x, y] = pose.eyeM;
  const direction: [number, number] = [dx / far, dy / far];
  for (const height of bodyHeights(pose)) {
    if (world.freeAhead([x, y, height], direction) < far + RADIUS_M) return null;
  }
  return standing(pose, x + dx, y + dy, world);
}
