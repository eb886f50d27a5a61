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
  /** Per triangle: 1 closed body with outward faces, -1 closed body turned inside out, 0 open surface. */
  readonly bodySide: Int8Array;
}

export function findEdges(triangles: StageTriangles, elements: readonly StageElement[]): StageEdges {
  const lines: number[] = [];
  const bodySide = new Int8Array(triangles.count);
  for (const element of elements) {
    const first = element.firstTriangle;
    const side = findElementEdges(triangles.cornersM, first, element.nTriangles, lines);
    bodySide.fill(side, first, first + element.nTriangles);
  }
  return { linesM: Float32Array.from(lines), bodySide };
}

interface Edge {
  readonly triangle: number;
  readonly start: number;
  nTriangles: number;
  isOpposed: boolean;
  isBent: boolean;
  readonly from: number;
  readonly to: number;
}

function findElementEdges(cornersM: Float32Array, first: number, n: number, lines: number[]): -1 | 0 | 1 {
  const corner = joinCorners(cornersM, first, n);
  const edges = new Map<number, Edge>();
  for (let t = 0; t < n; t++) {
    for (let k = 0; k < 3; k++) {
      const [from, to] = [3 * t + k, 3 * t + ((k + 1) % 3)];
      const [a, b] = [corner[from], corner[to]];
      if (a === b) continue;
      const key = Math.min(a, b) * 3 * n + Math.max(a, b);
      const edge = edges.get(key);
      if (edge === undefined) {
        edges.set(key, { triangle: t, start: a, nTriangles: 1, isOpposed: false, isBent: false, from, to });
      } else {
        edge.nTriangles++;
        edge.isOpposed = edge.start !== a;
        edge.isBent ||= bend(cornersM, first + edge.triangle, first + t, edge.isOpposed) > SMALLEST_BEND_RAD;
      }
    }
  }
  let isClosed = edges.size > 0;
  for (const edge of edges.values()) {
    isClosed &&= edge.nTriangles === 2 && edge.isOpposed;
    if (edge.nTriangles !== 1 && !edge.isBent) continue;
    for (const end of [edge.from, edge.to]) {
      const at = 9 * first + 3 * end;
      lines.push(cornersM[at], cornersM[at + 1], cornersM[at + 2]);
    }
  }
  if (!isClosed) return 0;
  return signedVolume(cornersM, first, n) >= 0 ? 1 : -1;
}

/** Number the corners of an element so that equal coordinates have equal numbers. */
function joinCorners(cornersM: Float32Array, first: number, n: number): Int32Array {
  const numbers = new Map<string, number>();
  const corner = new Int32Array(3 * n);
  for (let i = 0; i < 3 * n; i++) {
    const at = 9 * first + 3 * i;
    const key = `${cornersM[at]} ${cornersM[at + 1]} ${cornersM[at + 2]}`;
    let number = numbers.get(key);
    if (number === undefined) {
      number = numbers.size;
      numbers.set(key, number);
    }
    corner[i] = number;
  }
  return corner;
}

/** Angle between two triangles, 0 where they lie in one plane. */
function bend(cornersM: Float32Array, a: number, b: number, isOpposed: boolean): number {
  const [u, v] = [normalOf(cornersM, a), normalOf(cornersM, b)];
  const lengths = Math.hypot(...u) * Math.hypot(...v);
  if (lengths === 0) return 0;
  const cos = (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) / lengths;
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
