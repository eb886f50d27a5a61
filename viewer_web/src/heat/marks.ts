/** Which patches are highlighted: what only one station sees, what two share, a piece that nobody sees. */

/** Whether bit `patch` of a seen file is set: little endian within each byte, as docs/formats/stage.md has it. */
export function isSeen(bits: Uint8Array, patch: number): boolean {
  return ((bits[patch >> 3] >> (patch & 7)) & 1) === 1;
}

/** The bit, in the second row of a seen file, of what the station sees within the limits of all. */
export const bitWithinLimits = (patch: number, nPatches: number): number => 8 * Math.ceil(nPatches / 8) + patch;

/** 1 where both of two stations see the patch. */
export function sharedMarks(a: Uint8Array, b: Uint8Array, nPatches: number): Uint8Array {
  return Uint8Array.from({ length: nPatches }, (_, patch) => (isSeen(a, patch) && isSeen(b, patch) ? 1 : 0));
}

/** 1 where a station sees the patch and no other does. */
export function ownMarks(bits: Uint8Array, timesSeen: Uint8Array): Uint8Array {
  return timesSeen.map((times, patch) => (times === 1 && isSeen(bits, patch) ? 1 : 0));
}

/** 1 at the patches of any of the lists. */
export function listedMarks(lists: readonly Uint32Array[], nPatches: number): Uint8Array {
  const marks = new Uint8Array(nPatches);
  for (const patches of lists) for (const patch of patches) marks[patch] = 1;
  return marks;
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
