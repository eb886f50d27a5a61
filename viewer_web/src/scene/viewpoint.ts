/** From where a piece of surface can be looked at: from its front, near enough to fill the picture, with nothing in between. */
import { Ray, Vector3 } from 'three';
import type { View } from './camera.ts';

/** A viewer this near to a surface sees little of its surroundings; this far off is enough for any. */
const NEAREST_M = 5;
const FARTHEST_M = 30;
/** Distance in sizes of the piece, so that all of it is in the picture. */
const SIZES_AWAY = 2.8;
/** A ray begins off the surface, which it would meet otherwise; things stand nearer to each other than this hardly ever. */
const OFF_SURFACE_M = 0.003;
/** Nearer than this nobody recognises what is looked at. */
const LEAST_FREE_M = 0.35;
/** Nearer than this many sizes of the piece too little of it is in the picture to be recognised, as of the ceiling of a room. */
const LEAST_SIZES_AWAY = 0.6;
/** And with less room around an element nobody recognises that. */
const LEAST_ROOM_M = 1.2;

/** A part of the piece: a place on it, and the unit normal of its front. */
export interface PiecePart {
  readonly pointM: Vector3;
  readonly normal: Vector3;
}

export interface PieceToSee {
  /** The one in the middle first. */
  readonly parts: readonly PiecePart[];
  /** It is the skin of a body: behind is the inside. */
  readonly isOneSided: boolean;
  readonly sizeM: number;
}

/** What is around the piece. */
export interface Surroundings {
  /** How far one can go along a ray before something is met, metres; Infinity: nothing is. */
  freeLength(ray: Ray): number;
  /** The same where the element that the piece is a part of is not in the way. */
  freePastItself(ray: Ray): number;
  /** Whether nothing that is drawn lies between two places. */
  isOpen(fromM: Vector3, toM: Vector3): boolean;
}

/** Most of the piece in the picture counts more than all else. */
const SEEN_COUNTS = 3;
/** Squarer than this, a view tells nothing of what is around. */
const SQUARE_ENOUGH = 0.75;
/** Downwards and from a corner: in the levels of a building most is seen so. */
const FROM_OUTSIDE = [0.42, 0.78, 1.1] as const;

/**
 * The view that shows most of a piece: of directions from level to steep, head-on to oblique, the one from whose end most
 * parts are in plain view; of several such one that is far enough off, squarely to the surface, and looks down. A body
 * is looked at from its front alone. Where no view shows any part, as of the back of a shelf at a wall, or none is far enough
 * off to show what it is a part of, it looks from where
 * the element stands free, and where it does nowhere, as between a ceiling and the slab above, from outside, on the side of the
 * front: what is highlighted shows through.
 */
export function viewOf(piece: PieceToSee, around: Surroundings): View {
  const [{ pointM, normal }] = piece.parts;
  const wishedM = Math.min(FARTHEST_M, Math.max(NEAREST_M, SIZES_AWAY * piece.sizeM));
  const target = pointM.clone();
  let best: { readonly score: number; readonly position: Vector3 } | null = null;
  for (const direction of directions(normal, piece.isOneSided)) {
    const side = Math.sign(direction.dot(normal));
    const start = pointM.clone().addScaledVector(normal, side * OFF_SURFACE_M);
    // Short of what is met: the camera does not look through its back.
    const farM = Math.min(wishedM, 0.9 * around.freeLength(new Ray(start, direction)));
    if (farM < LEAST_FREE_M) continue;
    const position = start.clone().addScaledVector(direction, farM);
    const seen = shareSeen(piece, position, around);
    const score =
      SEEN_COUNTS * seen +
      farM / wishedM +
      0.3 * Math.min(SQUARE_ENOUGH, Math.abs(direction.dot(normal))) +
      0.15 * Math.max(-0.5, direction.z);
    if (seen > 0 && score > (best?.score ?? 0)) best = { score, position };
  }
  const isFarEnough = (best?.position.distanceTo(pointM) ?? 0) >= LEAST_SIZES_AWAY * piece.sizeM;
  const position = isFarEnough ? best?.position : (throughItself(piece, wishedM, around) ?? best?.position);
  return { position: position ?? pointM.clone().addScaledVector(outside(normal), wishedM), target };
}

/** From where there is most room around the element, behind which the piece is; null: it is walled in. */
function throughItself({ parts, sizeM }: PieceToSee, wishedM: number, around: Surroundings): Vector3 | null {
  const [{ pointM, normal }] = parts;
  const leastM = Math.max(LEAST_ROOM_M, LEAST_SIZES_AWAY * sizeM);
  let best: { readonly score: number; readonly position: Vector3 } | null = null;
  for (const direction of directions(normal, false)) {
    const farM = Math.min(wishedM, 0.9 * around.freePastItself(new Ray(pointM.clone(), direction)));
    if (farM < leastM) continue;
    const score = farM / wishedM + 0.3 * Math.min(SQUARE_ENOUGH, Math.abs(direction.dot(normal))) + 0.3 * direction.z;
    if (score > (best?.score ?? 0)) best = { score, position: pointM.clone().addScaledVector(direction, farM) };
  }
  return best?.position ?? null;
}

/** Share of the parts that a place has in plain view, from their front. */
function shareSeen({ parts, isOneSided }: PieceToSee, fromM: Vector3, around: Surroundings): number {
  const seen = parts.filter(({ pointM, normal }) => {
    const side = Math.sign(fromM.clone().sub(pointM).dot(normal));
    if (side === 0 || (isOneSided && side < 0)) return false;
    return around.isOpen(fromM, pointM.clone().addScaledVector(normal, side * OFF_SURFACE_M));
  });
  return seen.length / parts.length;
}

/** From above and from the corner that the front faces most. */
function outside(normal: Vector3): Vector3 {
  const [x, y, z] = FROM_OUTSIDE;
  const corners = [-1, 1].flatMap((i) =>
    [-1, 1].flatMap((j) => [new Vector3(i * x, j * y, z), new Vector3(i * y, j * x, z)]),
  );
  const facing = (corner: Vector3): number => corner.x * normal.x + corner.y * normal.y;
  return corners.reduce((most, corner) => (facing(corner) > facing(most) + 1e-9 ? corner : most)).normalize();
}

/** 32 directions on the front of a surface, and as many on its back unless that is the inside of a body; none within 15 degrees of it. */
function directions(normal: Vector3, isOneSided: boolean): Vector3[] {
  const up = Math.abs(normal.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0);
  const u = up.cross(normal).normalize();
  const v = normal.clone().cross(u);
  const found: Vector3[] = [];
  for (const sign of isOneSided ? [1] : [1, -1]) {
    for (const tilt of [15, 40, 60, 75]) {
      for (let turn = 0; turn < 360; turn += 45) {
        const [sin, cos] = [Math.sin((tilt * Math.PI) / 180), Math.cos((tilt * Math.PI) / 180)];
        const angle = (turn * Math.PI) / 180;
        found.push(
          normal
            .clone()
            .multiplyScalar(sign * cos)
            .addScaledVector(u, sin * Math.cos(angle))
            .addScaledVector(v, sin * Math.sin(angle)),
        );
      }
    }
  }
  return found;
}
