/** From where a piece of surface can be looked at: near enough to fill the picture, with nothing in between. */
import { Ray, Vector3 } from 'three';
import type { View } from './camera.ts';

/** A viewer this near to a surface sees little of its surroundings; this far off is enough for any. */
const NEAREST_M = 5;
const FARTHEST_M = 30;
/** Distance in sizes of the piece, so that all of it is in the picture. */
const SIZES_AWAY = 2.8;
/** The ray begins off the surface, which it would meet otherwise. */
const OFF_SURFACE_M = 0.02;

/** How far one can go along a ray before something is met, metres; Infinity: nothing is. */
export type FreeLength = (ray: Ray) => number;

/** Less of the wished distance than this shows nothing: better from outside, through what is in between. */
const LEAST_SHARE_FREE = 0.3;
/** Unless it is this much. */
const LEAST_FREE_M = 1.5;
/** Squarer than this, a view tells nothing of what is around. */
const SQUARE_ENOUGH = 0.75;
const FROM_OUTSIDE = new Vector3(-0.42, -0.78, 1.1).normalize();

/**
 * The best of views from both sides of the surface, level to steep, head-on to oblique: whichever has most of the wished
 * distance free, and of several such one that looks down at the surface, squarely enough. Where none is free, as between a
 * ceiling and the slab above, it looks from outside: what is pointed out shows through.
 */
export function viewOf(pointM: Vector3, normal: Vector3, sizeM: number, freeLength: FreeLength): View {
  const wishedM = Math.min(FARTHEST_M, Math.max(NEAREST_M, SIZES_AWAY * sizeM));
  let best = { score: 0, share: 0, direction: FROM_OUTSIDE };
  for (const direction of directions(normal)) {
    const start = pointM.clone().addScaledVector(direction, OFF_SURFACE_M);
    // Short of what is met: the camera does not look through its back.
    const share = Math.min(1, (0.9 * freeLength(new Ray(start, direction))) / wishedM);
    const score =
      share + 0.3 * Math.min(SQUARE_ENOUGH, Math.abs(direction.dot(normal))) + 0.15 * Math.max(-0.5, direction.z);
    if (score > best.score) best = { score, share, direction };
  }
  const isFree = best.share >= LEAST_SHARE_FREE || best.share * wishedM >= LEAST_FREE_M;
  const position = isFree
    ? pointM.clone().addScaledVector(best.direction, best.share * wishedM)
    : pointM.clone().addScaledVector(FROM_OUTSIDE, wishedM);
  return { position, target: pointM.clone() };
}

/** 48 directions on both sides of a surface, none within 20 degrees of it. */
function directions(normal: Vector3): Vector3[] {
  const side = Math.abs(normal.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0);
  const u = side.cross(normal).normalize();
  const v = normal.clone().cross(u);
  const found: Vector3[] = [];
  for (const sign of [1, -1]) {
    for (const tilt of [15, 45, 65]) {
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
