/**
 * What the merged triangles do at their edges: the lines worth drawing, and which elements are closed bodies.
 *
 * Corners are joined by their coordinates inside an element (files repeat points at seams). An edge is drawn where
 * two triangles meet at an angle, or where a single triangle ends. An element is closed when every edge has two triangles that
 * run along it in opposite directions; a body that is cut open then shows its inside, which is drawn as a section.
 */
import type { StageElement, StageTriangles } from './stage.ts';

/** Sharper bends than this get a line: a facet of a round column does not, a bevel does. */
const SMALLEST_BEND_RAD = (25 * Math.PI) / 180;

export interface StageEdges {
  /** (L, 2, 3) flat: both ends of each line, metres. */
  readonly linesM: Float32Array;
  /** (E + 1,): lines of element e are firstLine[e] ... firstLine[e + 1] - 1. */
  readonly firstLine: Int32Array;
  /** Per triangle: 1 closed body with outward faces, -1 closed body turned inside out, 0 open surface. */
  readonly bodySide: Int8Array;
}

export function findEdges(triangles: StageTriangles, elements: readonly StageElement[]): StageEdges {
  const lines = new GrowingFloats();
  const bodySide = new Int8Array(triangles.count);
  const largest = elements.reduce((most, { nTriangles }) => Math.max(most, nTriangles), 0);
  const scratch = new Scratch(3 * largest);
  const firstLine = new Int32Array(elements.length + 1);
  for (const [i, { firstTriangle, nTriangles }] of elements.entries()) {
    const side = findElementEdges(triangles.cornersM, firstTriangle, nTriangles, scratch, lines);
    bodySide.fill(side, firstTriangle, firstTriangle + nTriangles);
    firstLine[i + 1] = lines.length / 6;
  }
  return { linesM: lines.taken(), firstLine, bodySide };
}

/**
 * Hash tables of one element after the other, in arrays that are made once: with an object an edge, millions of triangles took
 * minutes. `table` holds numbers of records plus 1 at places that a hash names, the next free one where that is taken.
 */
class Scratch {
  readonly table: Int32Array;
  readonly corner: Int32Array;
  /** One a record of an edge: its corners by number, where it was met first, and what became of it. */
  readonly low: Int32Array;
  readonly high: Int32Array;
  readonly firstFrom: Int32Array;
  readonly firstTo: Int32Array;
  readonly nTriangles: Int32Array;
  readonly isOpposed: Uint8Array;
  readonly isBent: Uint8Array;

  constructor(nCorners: number) {
    this.table = new Int32Array(tableSize(nCorners));
    this.corner = new Int32Array(nCorners);
    this.low = new Int32Array(nCorners);
    this.high = new Int32Array(nCorners);
    this.firstFrom = new Int32Array(nCorners);
    this.firstTo = new Int32Array(nCorners);
    this.nTriangles = new Int32Array(nCorners);
    this.isOpposed = new Uint8Array(nCorners);
    this.isBent = new Uint8Array(nCorners);
  }

  /** The part of the table that `n` records need, emptied. */
  emptied(n: number): Int32Array {
    return this.table.subarray(0, tableSize(n)).fill(0);
  }
}

/** A power of 2, at most half of which is taken. */
function tableSize(nRecords: number): number {
  return 2 ** Math.ceil(Math.log2(Math.max(2, 2 * nRecords)));
}

/** Spreads three numbers over all bits. */
function hash(a: number, b: number, c: number): number {
  let h = Math.imul(a, 0x9e3779b1) ^ Math.imul(b, 0x85ebca6b) ^ Math.imul(c, 0xc2b2ae35);
  h ^= h >>> 15;
  h = Math.imul(h, 0x2c1b3c6d);
  return h ^ (h >>> 13);
}

function findElementEdges(
  cornersM: Float32Array,
  first: number,
  n: number,
  scratch: Scratch,
  lines: GrowingFloats,
): -1 | 0 | 1 {
  joinCorners(cornersM, first, n, scratch);
  const nEdges = collectEdges(cornersM, first, n, scratch);
  let isClosed = nEdges > 0;
  for (let edge = 0; edge < nEdges; edge++) {
    isClosed &&= scratch.nTriangles[edge] === 2 && scratch.isOpposed[edge] === 1;
    if (scratch.nTriangles[edge] !== 1 && scratch.isBent[edge] === 0) continue;
    for (const end of [scratch.firstFrom[edge], scratch.firstTo[edge]]) lines.push(cornersM, 9 * first + 3 * end);
  }
  if (!isClosed) return 0;
  return signedVolume(cornersM, first, n) >= 0 ? 1 : -1;
}

/** Record the edges in the order in which they are met; returns how many there are. */
function collectEdges(cornersM: Float32Array, first: number, n: number, scratch: Scratch): number {
  const { corner, low, high, firstFrom, firstTo, nTriangles, isOpposed, isBent } = scratch;
  const table = scratch.emptied(3 * n);
  const mask = table.length - 1;
  let nEdges = 0;
  for (let t = 0; t < n; t++) {
    for (let k = 0; k < 3; k++) {
      const [from, to] = [3 * t + k, k === 2 ? 3 * t : 3 * t + k + 1];
      const [a, b] = [corner[from], corner[to]];
      if (a === b) continue;
      const [lower, higher] = a < b ? [a, b] : [b, a];
      let at = hash(lower, higher, 0) & mask;
      while (table[at] !== 0 && (low[table[at] - 1] !== lower || high[table[at] - 1] !== higher)) at = (at + 1) & mask;
      if (table[at] === 0) {
        table[at] = nEdges + 1;
        low[nEdges] = lower;
        high[nEdges] = higher;
        firstFrom[nEdges] = from;
        firstTo[nEdges] = to;
        nTriangles[nEdges] = 1;
        isOpposed[nEdges] = isBent[nEdges] = 0;
        nEdges++;
        continue;
      }
      const edge = table[at] - 1;
      nTriangles[edge]++;
      isOpposed[edge] = corner[firstFrom[edge]] === a ? 0 : 1;
      if (isBent[edge] === 1) continue;
      const other = first + Math.floor(firstFrom[edge] / 3);
      if (bend(cornersM, other, first + t, isOpposed[edge] === 1) > SMALLEST_BEND_RAD) isBent[edge] = 1;
    }
  }
  return nEdges;
}

/** Number the corners of an element so that equal coordinates have equal numbers. */
function joinCorners(cornersM: Float32Array, first: number, n: number, scratch: Scratch): void {
  const { corner } = scratch;
  const table = scratch.emptied(3 * n);
  const mask = table.length - 1;
  const bits = new Int32Array(cornersM.buffer, cornersM.byteOffset, cornersM.length);
  // The bits of 0 and of -0 differ, and both are one place.
  const bitsAt = (at: number): number => (cornersM[at] === 0 ? 0 : bits[at]);
  for (let i = 0; i < 3 * n; i++) {
    const x = 9 * first + 3 * i;
    let at = hash(bitsAt(x), bitsAt(x + 1), bitsAt(x + 2)) & mask;
    for (; table[at] !== 0; at = (at + 1) & mask) {
      const y = 9 * first + 3 * (table[at] - 1);
      const isSame = cornersM[x] === cornersM[y] && cornersM[x + 1] === cornersM[y + 1];
      if (isSame && cornersM[x + 2] === cornersM[y + 2]) break;
    }
    if (table[at] === 0) table[at] = i + 1;
    corner[i] = table[at] - 1;
  }
}

/** Points in an array that doubles when it is full. */
class GrowingFloats {
  private values = new Float32Array(1 << 16);
  private n = 0;

  push(from: Float32Array, at: number): void {
    if (this.n + 3 > this.values.length) {
      const larger = new Float32Array(2 * this.values.length);
      larger.set(this.values);
      this.values = larger;
    }
    for (let k = 0; k < 3; k++) this.values[this.n++] = from[at + k];
  }

  get length(): number {
    return this.n;
  }

  taken(): Float32Array<ArrayBuffer> {
    return this.values.slice(0, this.n);
  }
}

/** Angle between two triangles, 0 where they lie in one plane. */
function bend(cornersM: Float32Array, a: number, b: number, isOpposed: boolean): number {
  const [ux, uy, uz] = normalOf(cornersM, a);
  const [vx, vy, vz] = normalOf(cornersM, b);
  const lengths = Math.sqrt((ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz));
  if (lengths === 0) return 0;
  const cos = (ux * vx + uy * vy + uz * vz) / lengths;
  return Math.acos(Math.min(1, Math.max(-1, isOpposed ? cos : -cos)));
}

/** Normal of a merged triangle, twice its area long. */
export function normalOf(cornersM: Float32Array, triangle: number): [number, number, number] {
  const i = 9 * triangle;
  const [x, y, z] = [cornersM[i], cornersM[i + 1], cornersM[i + 2]];
  const [ax, ay, az] = [cornersM[i + 3] - x, cornersM[i + 4] - y, cornersM[i + 5] - z];
  const [bx, by, bz] = [cornersM[i + 6] - x, cornersM[i + 7] - y, cornersM[i + 8] - z];
  return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
}

function signedVolume(cornersM: Float32Array, first: number, n: number): number {
  let volume = 0;
  // Relative to one corner of the body: far from the origin the products would cancel badly.
  const [ox, oy, oz] = cornersM.subarray(9 * first, 9 * first + 3);
  for (let t = first; t < first + n; t++) {
    const [nx, ny, nz] = normalOf(cornersM, t);
    volume += (cornersM[9 * t] - ox) * nx + (cornersM[9 * t + 1] - oy) * ny + (cornersM[9 * t + 2] - oz) * nz;
  }
  return volume;
}
