/**
 * The surface that a click on ground means: triangles in the plane of the clicked one, joined to it edge by edge.
 *
 * The server marks by the rule of docs/method/floor-picking.md when it plans; this shows beforehand what that will be.
 */
import { normalOf } from '../load/edges.ts';

/** Normals may differ by so much, and corners lie off the clicked plane by so much. */
const TILT_RAD = Math.PI / 180;
const OFF_PLANE_M = 0.01;
/** Corners are joined where they agree to this; the stage holds them in float32. */
const JOIN_M = 1e-4;

/** Numbers of the region's triangles, the clicked one first; none where that has no area. */
export function coplanarRegion(cornersM: Float32Array, clicked: number): number[] {
  const plane = planeOf(cornersM, clicked);
  if (plane === null) return [];
  const inPlane = trianglesInPlane(cornersM, plane);
  const trianglesOfEdge = new Map<string, number[]>();
  for (const triangle of inPlane) {
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
  return [...found];
}

interface Plane {
  readonly normal: readonly [number, number, number];
  readonly offsetM: number;
}

function planeOf(cornersM: Float32Array, triangle: number): Plane | null {
  const n = normalOf(cornersM, triangle);
  const length = Math.hypot(...n);
  if (length === 0) return null;
  const normal = [n[0] / length, n[1] / length, n[2] / length] as const;
  const i = 9 * triangle;
  const offsetM = normal[0] * cornersM[i] + normal[1] * cornersM[i + 1] + normal[2] * cornersM[i + 2];
  return { normal, offsetM };
}

function trianglesInPlane(cornersM: Float32Array, { normal, offsetM }: Plane): number[] {
  const found: number[] = [];
  const leastCos = Math.cos(TILT_RAD);
  for (let triangle = 0; triangle < cornersM.length / 9; triangle++) {
    let isIn = true;
    for (let i = 9 * triangle; isIn && i < 9 * triangle + 9; i += 3) {
      const off = normal[0] * cornersM[i] + normal[1] * cornersM[i + 1] + normal[2] * cornersM[i + 2] - offsetM;
      isIn = Math.abs(off) <= OFF_PLANE_M;
    }
    if (!isIn) continue;
    // Either way round: files turn faces as they like.
    const other = planeOf(cornersM, triangle);
    if (other === null) continue;
    const cos = normal[0] * other.normal[0] + normal[1] * other.normal[1] + normal[2] * other.normal[2];
    if (Math.abs(cos) >= leastCos) found.push(triangle);
  }
  return found;
}

function edgeKeys(cornersM: Float32Array, triangle: number): string[] {
  const corners = [0, 3, 6].map((k) => {
    const i = 9 * triangle + k;
    return [cornersM[i], cornersM[i + 1], cornersM[i + 2]].map((x) => Math.round(x / JOIN_M)).join(' ');
  });
  return [0, 1, 2].map((k) => [corners[k], corners[(k + 1) % 3]].sort().join(' | '));
}
