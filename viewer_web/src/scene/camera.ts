/** Where the camera stands: the view that fits a box, and the way from one view to another. */
import { MathUtils, Matrix4, Spherical, Vector3 } from 'three';
import type { Extent } from '../floors/cut.ts';

export interface View {
  readonly position: Vector3;
  readonly target: Vector3;
}

export interface Flight {
  readonly from: View;
  readonly to: View;
  readonly start: number;
  readonly durationMs: number;
}

/** Sides of what is shown, by the axis of the scene that points to them. */
export type PlanSide = '+x' | '-x' | '+y' | '-y';
export type Whence = 'side' | 'top' | PlanSide;

/** Somewhat from above: level, an opened floor is the outside of its walls. */
const ABOVE = 0.4;
/** `side`: from the south-south-west, steep enough to look into rooms. `top` is not quite vertical: there, north would be lost. */
const DIRECTIONS: Readonly<Record<Whence, Vector3>> = {
  side: new Vector3(-0.42, -0.78, 0.88).normalize(),
  top: new Vector3(0, -0.0005, 1).normalize(),
  '+x': new Vector3(1, 0, ABOVE).normalize(),
  '-x': new Vector3(-1, 0, ABOVE).normalize(),
  '+y': new Vector3(0, 1, ABOVE).normalize(),
  '-y': new Vector3(0, -1, ABOVE).normalize(),
};
/** Room left around the box, for the markers at its rim and the controls above it. */
const MARGIN = 1.15;

/** What panels cover at the sides of the picture, as shares of its width and height. */
export interface Covered {
  readonly right: number;
  readonly top: number;
  readonly bottom: number;
}

export const NOTHING_COVERED: Covered = { right: 0, top: 0, bottom: 0 };
/** More than this is not left free: on small screens panels cover most of the picture, and the box would be a speck. */
const MOST_COVERED = 0.5;

/** The nearest view along a fixed direction that has all of the box in what panels leave of the picture. */
export function homeView(
  extent: Extent,
  from: Whence,
  lens: { readonly fieldOfViewDeg: number; readonly aspect: number },
  covered: Covered = NOTHING_COVERED,
): View {
  const [min, max] = [new Vector3(...extent.minM), new Vector3(...extent.maxM)];
  const target = min.clone().add(max).multiplyScalar(0.5);
  const back = DIRECTIONS[from];
  const orientation = new Matrix4().lookAt(back, new Vector3(), new Vector3(0, 0, 1));
  const right = new Vector3().setFromMatrixColumn(orientation, 0);
  const up = new Vector3().setFromMatrixColumn(orientation, 1);
  const slopeY = Math.tan((lens.fieldOfViewDeg * Math.PI) / 360);
  const slopeX = slopeY * lens.aspect;
  const [coveredX, top, bottom] = [covered.right, covered.top, covered.bottom].map((share) =>
    Math.min(MOST_COVERED, share),
  );
  const coveredY = Math.min(MOST_COVERED, top + bottom);
  // The middle of what is free, from -1 to 1 across and up, is half as far off the picture's as the panel is wide.
  const [x, y] = [-coveredX, Math.max(-MOST_COVERED, Math.min(MOST_COVERED, bottom - top))];
  let distance = 0;
  for (let i = 0; i < 8; i++) {
    const corner = new Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z).sub(target);
    const nearer = corner.dot(back);
    const wide = Math.max(
      Math.abs(corner.dot(right) / slopeX + x * nearer) / (1 - coveredX),
      Math.abs(corner.dot(up) / slopeY + y * nearer) / (1 - coveredY),
    );
    distance = Math.max(distance, nearer + wide * MARGIN);
  }
  distance = Math.max(distance, 1);
  target.addScaledVector(right, -x * slopeX * distance).addScaledVector(up, -y * slopeY * distance);
  return { target, position: target.clone().addScaledVector(back, distance) };
}

/** As far from what it looks at, straight above it: where nothing but a plan is drawn, a drag shifts along that. */
export function straightAbove({ position, target }: View): Vector3 {
  return target.clone().addScaledVector(DIRECTIONS.top, position.distanceTo(target));
}

/** So near to straight from above or below the camera goes: beyond it, left and right would change places. */
const NEAREST_TO_UP_RAD = 0.0005;

/** Where the camera stands after a turn about what it looks at, counterclockwise, tilted away from straight above. */
export function orbited({ position, target }: View, turnRad: number, tiltRad: number, closer: number): number[] {
  const around = aroundOf(position.clone().sub(target));
  around.theta += turnRad;
  around.phi = Math.min(Math.PI - NEAREST_TO_UP_RAD, Math.max(NEAREST_TO_UP_RAD, around.phi + tiltRad));
  around.radius *= closer;
  return awayOf(around).add(target).toArray();
}

/** Of the way from what is looked at to the camera; three.js has the second axis up. */
const aroundOf = ({ x, y, z }: Vector3): Spherical => new Spherical().setFromCartesianCoords(x, z, -y);

function awayOf(around: Spherical): Vector3 {
  const { x, y, z } = new Vector3().setFromSpherical(around);
  return new Vector3(x, -z, y);
}

/** Between two ways from what is looked at to the camera: round it, since the straight line could lead through it. */
function roundBetween(from: Vector3, to: Vector3, share: number): Vector3 {
  const [a, b] = [aroundOf(from), aroundOf(to)];
  if (a.radius === 0 || b.radius === 0) return from.clone().lerp(to, share);
  const turn = MathUtils.euclideanModulo(b.theta - a.theta + Math.PI, 2 * Math.PI) - Math.PI;
  const between = (x: number, y: number): number => x + share * (y - x);
  return awayOf(new Spherical(between(a.radius, b.radius), between(a.phi, b.phi), a.theta + share * turn));
}

/** Where a flight is at time `now`, slow at both ends. */
export function flightAt(flight: Flight, now: number): { view: View; isOver: boolean } {
  const share = flight.durationMs > 0 ? Math.max(0, Math.min(1, (now - flight.start) / flight.durationMs)) : 1;
  const eased = share * share * (3 - 2 * share);
  const { from, to } = flight;
  const target = from.target.clone().lerp(to.target, eased);
  const away = roundBetween(from.position.clone().sub(from.target), to.position.clone().sub(to.target), eased);
  return {
    view: { position: target.clone().add(away), target },
    isOver: share >= 1,
  };
}
