/**
 * The surface that a click on ground means: triangles in the plane of the clicked one, joined to it edge by edge.
 *
 * The server marks by the rule of docs/method/floor-picking.md when it plans, in float64; this shows beforehand what that will
 * be, by the same rule on the stage's float32.
 */
import { normalOf } from '../load/edges.ts';

/** Normals may differ by so much, and corners lie off the plane by so much. */
const TILT_RAD = (2 * Math.PI) / 180;
const OFF_PLANE_M = 0.01;
/** The plane is fitted to what was found, and the region grown again, at most so often. */
const MOST_ROUNDS = 8;
/** Steeper surfaces bear no tripod. */
const STEEPEST_RAD = (10 * Math.PI) / 180;

/** Numbers of the region's triangles, rising; none where the clicked one has no area. */
export function coplanarRegion(cornersM: Float32Array, clicked: number): number[] {
  let plane = planeOf(cornersM, clicked);
  let region: number[] = [];
  for (let round = 0; plane !== null && round < MOST_ROUNDS; round++) {
    const grown = grow(cornersM, clicked, plane);
    const isSame = grown.length === region.length && grown.every((triangle, i) => triangle === region[i]);
    region = grown;
    if (isSame) break;
    plane = fitted(cornersM, region, plane);
  }
  return region;
}

/** Whether a triangle is too steep for a tripod, or has no area. */
export function isSteep(cornersM: Float32Array, triangle: number): boolean {
  const plane = planeOf(cornersM, triangle);
  return plane === null || Math.abs(plane.normal[2]) < Math.cos(STEEPEST_RAD);
}

type Vector = readonly [number, number, number];

interface Plane {
  readonly normal: Vector;
  readonly offsetM: number;
}

const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function planeOf(cornersM: Float32Array, triangle: number): Plane | null {
  const n = normalOf(cornersM, triangle);
  const length = Math.hypot(...n);
  if (length === 0) return null;
  const normal: Vector = [n[0] / length, n[1] / length, n[2] / length];
  const i = 9 * triangle;
  return { normal, offsetM: dot(normal, [cornersM[i], cornersM[i + 1], cornersM[i + 2]]) };
}

function grow(cornersM: Float32Array, clicked: number, plane: Plane): number[] {
  const trianglesOfEdge = new Map<string, number[]>();
  for (const triangle of trianglesIn(cornersM, plane)) {
    for (const key of edgeKeys(cornersM, triangle)) {
      const others = trianglesOfEdge.get(key);
      if (others === undefined) trianglesOfEdge.set(key, [triangle]);
      else others.push(triangle);
    }
  }
  const found = new Set([clicked]);
  // A set grows while it is walked through: breadth first.
  for (const triangle of found) {
    for (const key of edgeKeys(cornersM, triangle)) {
      for (const neighbour of trianglesOfEdge.get(key) ?? []) found.add(neighbour);
    }
  }
  return [...found].sort((a, b) => a - b);
}

function trianglesIn(cornersM: Float32Array, { normal, offsetM }: Plane): number[] {
  const found: number[] = [];
  const leastCos = Math.cos(TILT_RAD);
  for (let triangle = 0; triangle < cornersM.length / 9; triangle++) {
    let isIn = true;
    for (let i = 9 * triangle; isIn && i < 9 * triangle + 9; i += 3) {
      isIn = Math.abs(dot(normal, [cornersM[i], cornersM[i + 1], cornersM[i + 2]]) - offsetM) <= OFF_PLANE_M;
    }
    // Either way round: files turn faces as they like.
    if (isIn && Math.abs(dot(normal, planeOf(cornersM, triangle)?.normal ?? [0, 0, 0])) >= leastCos) {
      found.push(triangle);
    }
  }
  return found;
}

/** The plane through the region's centre with its mean normal, both by area. */
function fitted(cornersM: Float32Array, region: readonly number[], before: Plane): Plane {
  const normal: [number, number, number] = [0, 0, 0];
  const centre: [number, number, number] = [0, 0, 0];
  let area = 0;
  for (const triangle of region) {
    const n = normalOf(cornersM, triangle);
    const weight = Math.hypot(...n);
    const turn = dot(n, before.normal) < 0 ? -1 : 1;
    area += weight;
    for (let k = 0; k < 3; k++) {
      const at = 9 * triangle + k;
      normal[k] += turn * n[k];
      centre[k] += (weight * (cornersM[at] + cornersM[at + 3] + cornersM[at + 6])) / 3;
    }
  }
  const length = Math.hypot(...normal);
  if (length === 0) return before;
  const unit: Vector = [normal[0] / length, normal[1] / length, normal[2] / length];
  return { normal: unit, offsetM: dot(unit, centre) / area };
}

/** Corners of the same bits are the same vertex of the scene. */
function edgeKeys(cornersM: Float32Array, triangle: number): string[] {
  const corners = [0, 3, 6].map((k) => {
    const i = 9 * triangle + k;
    return `${cornersM[i]} ${cornersM[i + 1]} ${cornersM[i + 2]}`;
  });
  return [0, 1, 2].map((k) => [corners[k], corners[(k + 1) % 3]].sort().join(' | '));
}
