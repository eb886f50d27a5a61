/** The triangle that a stored point lies on. */

/** A point further off is on no surface; docs/method/floor-picking.md has the same. */
const FARTHEST_M = 0.05;

/** Number of the nearest triangle within 5 cm of a point (local frame); null: none. */
export function triangleAt(cornersM: Float32Array, point: readonly [number, number, number]): number | null {
  let best: number | null = null;
  let bestM = FARTHEST_M;
  for (let t = 0; t < cornersM.length / 9; t++) {
    const at = 9 * t;
    let isNear = true;
    for (let k = 0; isNear && k < 3; k++) {
      const [a, b, c] = [cornersM[at + k], cornersM[at + 3 + k], cornersM[at + 6 + k]];
      isNear = point[k] >= Math.min(a, b, c) - bestM && point[k] <= Math.max(a, b, c) + bestM;
    }
    if (!isNear) continue;
    const distanceM = distanceTo(cornersM, at, point);
    if (distanceM < bestM) [best, bestM] = [t, distanceM];
  }
  return best;
}

type Vector = readonly [number, number, number];
const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Distance of a point to the triangle at `at`, by the nearest of its plane's foot and its three sides. */
function distanceTo(cornersM: Float32Array, at: number, p: Vector): number {
  const corner = (k: number): Vector => [cornersM[at + 3 * k], cornersM[at + 3 * k + 1], cornersM[at + 3 * k + 2]];
  const [a, b, c] = [corner(0), corner(1), corner(2)];
  const [ab, ac, ap] = [minus(b, a), minus(c, a), minus(p, a)];
  const [abab, abac, acac, apab, apac] = [dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ap, ab), dot(ap, ac)];
  const determinant = abab * acac - abac * abac;
  if (determinant > 0) {
    const v = (acac * apab - abac * apac) / determinant;
    const w = (abab * apac - abac * apab) / determinant;
    if (v >= 0 && w >= 0 && v + w <= 1) {
      const foot: Vector = [
        ap[0] - v * ab[0] - w * ac[0],
        ap[1] - v * ab[1] - w * ac[1],
        ap[2] - v * ab[2] - w * ac[2],
      ];
      return Math.hypot(...foot);
    }
  }
  return Math.min(toSide(a, b, p), toSide(b, c, p), toSide(c, a, p));
}

function toSide(a: Vector, b: Vector, p: Vector): number {
  const [ab, ap] = [minus(b, a), minus(p, a)];
  const length = dot(ab, ab);
  const share = length > 0 ? Math.min(1, Math.max(0, dot(ap, ab) / length)) : 0;
  return Math.hypot(ap[0] - share * ab[0], ap[1] - share * ab[1], ap[2] - share * ab[2]);
}
