/** Which patches are pointed out: what only one station sees, what two share, a piece that nobody sees. */
import type { Vector3 } from 'three';
import type { PatchPlaces } from '../scene/patch-places.ts';

/** Whether bit `patch` of a seen file is set: little endian within each byte, as docs/formats/stage.md has it. */
export function isSeen(bits: Uint8Array, patch: number): boolean {
  return ((bits[patch >> 3] >> (patch & 7)) & 1) === 1;
}

/** 1 where both of two stations see the patch. */
export function sharedMarks(a: Uint8Array, b: Uint8Array, nPatches: number): Uint8Array {
  return Uint8Array.from({ length: nPatches }, (_, patch) => (isSeen(a, patch) && isSeen(b, patch) ? 1 : 0));
}

/** What is asked of a view of a patch for it to count, as far as it is known of each station by itself. */
export interface ViewLimits {
  readonly range_m: number | null;
  readonly incidence_rad: number | null;
}

/**
 * 1 where a station sees the patch and just as many do as are asked for: without it too few would. `meets`: whether the station
 * sees the patch well enough; who sees it otherwise is not counted in `timesSeen`.
 */
export function ownMarks(
  bits: Uint8Array,
  timesSeen: Uint8Array,
  seenFrom: number,
  meets: (patch: number) => boolean,
): Uint8Array {
  return timesSeen.map((times, patch) => (times === seenFrom && isSeen(bits, patch) && meets(patch) ? 1 : 0));
}

/** Whether the middle of a patch is within the limits, seen from `fromM` (local frame). */
export function isWithin(fromM: Vector3, patch: number, limits: ViewLimits, places: PatchPlaces): boolean {
  const place = places.placeOf(patch);
  if (place === null) return false;
  const beam = place.pointM.clone().sub(fromM);
  const rangeM = beam.length();
  if (limits.range_m !== null && rangeM > limits.range_m) return false;
  const leastCosine = limits.incidence_rad === null ? 0 : Math.cos(limits.incidence_rad);
  return Math.abs(beam.dot(place.normal)) >= leastCosine * rangeM;
}

/** 1 where the patch is of the piece that `named` names; `pieces` as viewer/pieces.i32. */
export function pieceMarks(pieces: Int32Array, named: number): Uint8Array {
  return Uint8Array.from(pieces, (piece) => (piece === named ? 1 : 0));
}

export function markedArea(marks: Uint8Array, areasM2: Float32Array): number {
  let sum = 0;
  for (let patch = 0; patch < marks.length; patch++) if (marks[patch] !== 0) sum += areasM2[patch];
  return sum;
}
