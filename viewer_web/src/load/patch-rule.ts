/**
 * The patch under a point of a triangle, by the rule of docs/method/patches.md, on the CPU and in GLSL.
 *
 * Float32 throughout, in the document's order of operations: ties between edges of equal length (every right-angled
 * triangle has them after the first bisection) must break as they did in the planner.
 */

const { fround } = Math;

/** Squared lengths of the edges 01, 12, 20 of a triangle: float64 from its corners, rounded to float32. */
export function squaredEdges(corners: ArrayLike<number>, from: number): [number, number, number] {
  const square = (a: number, b: number): number => {
    const x = corners[from + b] - corners[from + a];
    const y = corners[from + b + 1] - corners[from + a + 1];
    const z = corners[from + b + 2] - corners[from + a + 2];
    return fround(x * x + y * y + z * z);
  };
  return [square(0, 3), square(3, 6), square(6, 0)];
}

/** Path down the bisection tree, a number of `depth` bits; arguments are barycentric weights and squared edges. */
export function patchCode(
  [w0, w1, w2]: readonly [number, number, number],
  [s01, s12, s20]: readonly [number, number, number],
  depth: number,
): number {
  let [l0, l1, l2] = [fround(w0), fround(w1), fround(w2)];
  let [q01, q12, q20] = [fround(s01), fround(s12), fround(s20)];
  let code = 0;
  for (let level = 0; level < depth; level++) {
    let [la, lb, lc, qab, qbc, qca] = [l0, l1, l2, q01, q12, q20];
    if (!(q01 >= q12 && q01 >= q20)) {
      if (q12 >= q20) [la, lb, lc, qab, qbc, qca] = [l1, l2, l0, q12, q20, q01];
      else [la, lb, lc, qab, qbc, qca] = [l2, l0, l1, q20, q01, q12];
    }
    const middle = fround(fround(fround(fround(2 * qca) + fround(2 * qbc)) - qab) / 4);
    q01 = fround(qab / 4);
    if (la >= lb) {
      [l0, l1, l2] = [fround(la - lb), fround(2 * lb), lc];
      [q12, q20] = [middle, qca];
      code *= 2;
    } else {
      [l0, l1, l2] = [fround(2 * la), fround(lb - la), lc];
      [q12, q20] = [qbc, middle];
      code = code * 2 + 1;
    }
  }
  return code;
}

/** Corners of a patch, nine numbers: the triangle at `from` of `corners`, halved along the path `code`. */
export function patchCorners(
  corners: ArrayLike<number>,
  from: number,
  [s01, s12, s20]: readonly [number, number, number],
  depth: number,
  code: number,
): number[] {
  const vertex = (k: number): number[] => [corners[from + 3 * k], corners[from + 3 * k + 1], corners[from + 3 * k + 2]];
  let [v0, v1, v2] = [vertex(0), vertex(1), vertex(2)];
  let [q01, q12, q20] = [fround(s01), fround(s12), fround(s20)];
  for (let level = depth - 1; level >= 0; level--) {
    let [a, b, c, qab, qbc, qca] = [v0, v1, v2, q01, q12, q20];
    if (!(q01 >= q12 && q01 >= q20)) {
      if (q12 >= q20) [a, b, c, qab, qbc, qca] = [v1, v2, v0, q12, q20, q01];
      else [a, b, c, qab, qbc, qca] = [v2, v0, v1, q20, q01, q12];
    }
    const middle = fround(fround(fround(fround(2 * qca) + fround(2 * qbc)) - qab) / 4);
    const m = a.map((x, k) => (x + b[k]) / 2);
    q01 = fround(qab / 4);
    if (Math.floor(code / 2 ** level) % 2 === 0) [v0, v1, v2, q12, q20] = [a, m, c, middle, qca];
    else [v0, v1, v2, q12, q20] = [m, b, c, qbc, middle];
  }
  return [...v0, ...v1, ...v2];
}

/** `uint patchCode(vec3 weights, vec3 squaredEdges, int depth)`: the same in GLSL ES 3. */
export const PATCH_CODE_GLSL = /* glsl */ `
uint patchCode(vec3 l, vec3 q, int depth) {
  uint code = 0u;
  for (int level = 0; level < depth; level++) {
    if (!(q.x >= q.y && q.x >= q.z)) {
      if (q.y >= q.z) { l = l.yzx; q = q.yzx; } else { l = l.zxy; q = q.zxy; }
    }
    float middle = (2.0 * q.z + 2.0 * q.y - q.x) / 4.0;
    if (l.x >= l.y) {
      l = vec3(l.x - l.y, 2.0 * l.y, l.z);
      q = vec3(q.x / 4.0, middle, q.z);
      code = code * 2u;
    } else {
      l = vec3(2.0 * l.x, l.y - l.x, l.z);
      q = vec3(q.x / 4.0, q.y, middle);
      code = code * 2u + 1u;
    }
  }
  return code;
}
`;
