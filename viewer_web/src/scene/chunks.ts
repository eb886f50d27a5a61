/**
 * The building in pieces of up to some ten thousand triangles: what a slice does not reach or the camera does not see is not
 * drawn. With all floors spread, a piece is drawn once for each floor whose slice it reaches.
 *
 * Elements come storey by storey, and a new storey begins a new piece, so that a piece reaches few slices: its own and, with its
 * walls and slabs, one beside. Each piece has a geometry of its own, since where a shader's vertex numbers begin is not the same
 * everywhere when a part of one is drawn.
 */
import { BufferAttribute, BufferGeometry } from 'three';
import type { Slice } from '../floors/cut.ts';
import type { StageElement } from '../load/stage.ts';

/** Fewer make more calls than a driver likes, more make pieces that always reach into every slice. */
const TRIANGLES_A_CHUNK = 32_768;
/** What is left of a storey goes with the next where it is less than this: a call costs as much. */
const LEAST_TRIANGLES = 1024;
/** Lines come in the order of elements, but do not know theirs. */
const LINES_A_CHUNK = 16_384;

export interface Chunk {
  readonly geometry: BufferGeometry;
  /** Of the merged list. */
  readonly firstTriangle: number;
  readonly lowestM: number;
  readonly highestM: number;
}

/** Pieces of whole elements of a storey; only an element that is larger than that is more than a piece should be. */
export function surfaceChunks(cornersM: Float32Array, elements: readonly StageElement[]): Chunk[] {
  const chunks: Chunk[] = [];
  let [first, n] = [0, 0];
  for (const [i, { floorId, firstTriangle, nTriangles }] of elements.entries()) {
    n = firstTriangle + nTriangles - first;
    const isLastOfStorey = elements[i + 1]?.floorId !== floorId;
    if (n < (isLastOfStorey ? LEAST_TRIANGLES : TRIANGLES_A_CHUNK)) continue;
    chunks.push(chunkOf(cornersM, 9 * first, 9 * n, first));
    [first, n] = [first + n, 0];
  }
  if (n > 0) chunks.push(chunkOf(cornersM, 9 * first, 9 * n, first));
  return chunks;
}

export function lineChunks(linesM: Float32Array): Chunk[] {
  const chunks: Chunk[] = [];
  for (let at = 0; at < linesM.length; at += 6 * LINES_A_CHUNK) {
    chunks.push(chunkOf(linesM, at, Math.min(6 * LINES_A_CHUNK, linesM.length - at), 0));
  }
  return chunks;
}

/** Whether any of a piece can be in a slice. */
export function reaches({ lowestM, highestM }: Chunk, { bottomM, topM }: Slice): boolean {
  return lowestM <= topM && highestM >= bottomM;
}

function chunkOf(values: Float32Array, from: number, n: number, firstTriangle: number): Chunk {
  const own = values.subarray(from, from + n);
  let [lowestM, highestM] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let i = 2; i < own.length; i += 3) {
    lowestM = Math.min(lowestM, own[i]);
    highestM = Math.max(highestM, own[i]);
  }
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(own, 3));
  geometry.computeBoundingSphere();
  return { geometry, firstTriangle, lowestM, highestM };
}
