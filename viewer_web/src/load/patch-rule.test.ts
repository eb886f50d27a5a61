/** The patch rule against a bisection of the triangle's geometry in float64, and against the planner's own. */
import { expect, test } from 'vitest';
import { runPython } from '../testing/python.ts';
import { patchCode, squaredEdges } from './patch-rule.ts';

type Vector = [number, number, number];

/** Small generator of uniform numbers (mulberry32), so that a failure can be repeated by its seed. */
function uniform(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const middle = (p: Vector, q: Vector): Vector => [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2];
const distance2 = (p: Vector, q: Vector): number => p.reduce((sum, x, i) => sum + (x - q[i]) ** 2, 0);

/** Bisect the corners themselves and return the centroid of the leaf that `code` names. */
function centroidOfLeaf(corners: [Vector, Vector, Vector], code: number, depth: number): Vector {
  let [p, q, r] = corners;
  for (let bit = depth - 1; bit >= 0; bit--) {
    const [pq, qr, rp] = [distance2(p, q), distance2(q, r), distance2(r, p)];
    const [a, b, c] = pq >= qr && pq >= rp ? [p, q, r] : qr >= rp ? [q, r, p] : [r, p, q];
    const m = middle(a, b);
    [p, q, r] = (code >> bit) & 1 ? [m, b, c] : [a, m, c];
  }
  return [0, 1, 2].map((i) => (p[i] + q[i] + r[i]) / 3) as Vector;
}

/** Barycentric weights of a point in the plane of a triangle, by least squares in float64. */
function weightsOf([p, q, r]: [Vector, Vector, Vector], at: Vector): Vector {
  const minus = (u: Vector, v: Vector): Vector => [u[0] - v[0], u[1] - v[1], u[2] - v[2]];
  const dot = (u: Vector, v: Vector): number => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const [e, f, g] = [minus(q, p), minus(r, p), minus(at, p)];
  const [ee, ef, ff, eg, fg] = [dot(e, e), dot(e, f), dot(f, f), dot(e, g), dot(f, g)];
  const scale = ee * ff - ef * ef;
  const [v, w] = [(ff * eg - ef * fg) / scale, (ee * fg - ef * eg) / scale];
  return [1 - v - w, v, w];
}

test.each([1, 2, 3])('patch code of a leaf centroid is the leaf, random triangles, seed %i', (seed) => {
  const next = uniform(seed);
  const vector = (): Vector => [next() * 8, next() * 8, next() * 3];
  for (let i = 0; i < 100; i++) {
    const corners: [Vector, Vector, Vector] = [vector(), vector(), vector()];
    const edges = squaredEdges(corners.flat(), 0);
    const depth = 1 + Math.floor(next() * 7);
    for (let code = 0; code < 2 ** depth; code++) {
      const weights = weightsOf(corners, centroidOfLeaf(corners, code, depth));
      expect(patchCode(weights, edges, depth), `triangle ${i} ${JSON.stringify(corners)}`).toBe(code);
    }
  }
});

test('patch code is 0 where nothing is bisected', () => {
  expect(patchCode([0.2, 0.3, 0.5], [1, 2, 3], 0)).toBe(0);
});

test('patch codes equal those of the planner, right-angled and equal-sided triangles included', () => {
  const script = `
import json, numpy as np
from planner_core.scene.patches import patch_code, squared_edges
rng = np.random.default_rng(5)
corners = rng.uniform(0, 6, (400, 3, 3)).astype(np.float32).astype(np.float64)
corners[:200] = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]]) * rng.integers(1, 9, (200, 1, 3))
corners[200:250] = [[0, 0, 0], [2, 0, 0], [1, np.sqrt(3), 0]]
weights = rng.dirichlet([1, 1, 1], 400).astype(np.float32)
edges = squared_edges(corners)
depth = rng.integers(0, 12, 400)
code = patch_code(weights, edges, depth)
print(json.dumps([x.tolist() for x in (corners.reshape(400, 9), weights, edges, depth, code)]))
`;
  const [corners, weights, edges, depth, code] = JSON.parse(runPython('-c', script));
  for (let i = 0; i < depth.length; i++) {
    expect(squaredEdges(corners[i], 0), `edges of triangle ${i}`).toEqual(edges[i]);
    expect(patchCode(weights[i], edges[i], depth[i]), `code in triangle ${i}`).toBe(code[i]);
  }
});
