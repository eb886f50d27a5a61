/**
 * The building in pieces of up to some ten thousand triangles: what a slice does not reach or the camera does not see is not
 * drawn. With all floors spread, a piece is drawn once for each floor whose slice it reaches.
 *
 * Elements come file by file and storey by storey. A new storey begins a new piece, so that a piece reaches few slices: its own
 * and, with its walls and slabs, one beside. So does a new file, since files are switched on and off. Each piece has a geometry of its own, since where a shader's vertex numbers begin is not the same
 * everywhere when a part of one is drawn.
 */
import { BufferAttribute, BufferGeometry } from 'three';
import type { Slice } from '../floors/cut.ts';
import type { StageEdges } from '../load/edges.ts';
import type { StageElement } from '../load/stage.ts';

/** Fewer make more calls than a driver likes, more make pieces that always reach into every slice. */
const TRIANGLES_A_CHUNK = 32_768;
/** What is left of a storey goes with the next where it is less than this: a call costs as much. */
const LEAST_TRIANGLES = 1024;
const LINES_A_CHUNK = 16_384;

export interface Chunk {
  readonly geometry: BufferGeometry;
  /** Of the merged list. */
  readonly firstTriangle: number;
  readonly lowestM: number;
  readonly highestM: number;
  /** Number of the file that all of it is in. */
  readonly file: number;
}

/** Pieces of whole elements of a storey; only an element that is larger than that is more than a piece should be. */
export function surfaceChunks(cornersM: Float32Array, elements: readonly StageElement[]): Chunk[] {
  const chunks: Chunk[] = [];
  let [first, n] = [0, 0];
  for (const [i, { file, floorId, firstTriangle, nTriangles }] of elements.entries()) {
    n = firstTriangle + nTriangles - first;
    const next = elements[i + 1];
    const isLastOfStorey = next?.floorId !== floorId;
    if (next?.file === file && n < (isLastOfStorey ? LEAST_TRIANGLES : TRIANGLES_A_CHUNK)) continue;
    chunks.push(chunkOf(cornersM, 9 * first, 9 * n, file, first));
    [first, n] = [first + n, 0];
  }
  return chunks;
}

/** Pieces of lines of a file. */
export function lineChunks({ linesM, firstLine }: StageEdges, elements: readonly StageElement[]): Chunk[] {
  const chunks: Chunk[] = [];
  let first = 0;
  for (const [i, { file }] of elements.entries()) {
    if (elements[i + 1]?.file === file) continue;
    const end = firstLine[i + 1];
    for (; first < end; first = Math.min(end, first + LINES_A_CHUNK)) {
      chunks.push(chunkOf(linesM, 6 * first, 6 * Math.min(LINES_A_CHUNK, end - first), file, 0));
    }
  }
  return chunks;
}

/** Whether any of a piece can be in a slice. */
export function reaches({ lowestM, highestM }: Chunk, { bottomM, topM }: Slice): boolean {
  return lowestM <= topM && highestM >= bottomM;
}

function chunkOf(values: Float32Array, from: number, n: number, file: number, firstTriangle: number): Chunk {
  const own = values.subarray(from, from + n);
  let [lowestM, highestM] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let i = 2; i < own.length; i += 3) {
    lowestM = Math.min(lowestM, own[i]);
    highestM = Math.max(highestM, own[i]);
  }
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(own, 3));
  geometry.computeBoundingSphere();
  return { geometry, firstTriangle, lowestM, highestM, file };
}
