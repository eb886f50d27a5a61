import { expect, test } from 'vitest';
import { findEdges, normalOf } from './edges.ts';
import type { StageElement, StageTriangles } from './stage.ts';

/** The twelve triangles of a unit cube, faces outward. */
const CUBE_FACES = [
  [0, 2, 3, 1],
  [4, 5, 7, 6],
  [0, 1, 5, 4],
  [2, 6, 7, 3],
  [0, 4, 6, 2],
  [1, 3, 7, 5],
];

function cube({ isInsideOut = false, nFaces = 6 } = {}): StageTriangles {
  const corners = CUBE_FACES.slice(0, nFaces).flatMap(([a, b, c, d]) =>
    [
      [a, b, c],
      [a, c, d],
    ].flatMap((triangle) =>
      (isInsideOut ? triangle.reverse() : triangle).flatMap((i) => [100 + (i & 1), (i >> 1) & 1, (i >> 2) & 1]),
    ),
  );
  const count = corners.length / 9;
  return {
    count,
    cornersM: Float32Array.from(corners),
    squaredEdgesM2: new Float32Array(3 * count),
    element: new Int32Array(count),
    firstPatch: new Int32Array(count),
    patchDepth: new Uint8Array(count),
    groundOf: new Uint8Array(count),
  };
}

const whole = (triangles: StageTriangles): StageElement[] => [
  {
    sceneIndex: 0,
    name: 'cube',
    kind: 'Mesh',
    sourceId: '',
    floorId: '',
    file: 0,
    firstTriangle: 0,
    nTriangles: triangles.count,
  },
];

test('a cube has twelve lines and none along the diagonals of its faces', () => {
  const { linesM } = findEdges(cube(), whole(cube()));
  expect(linesM.length).toBe(12 * 6);
  for (let i = 0; i < linesM.length; i += 6) {
    const length = Math.hypot(...[0, 1, 2].map((k) => linesM[i + k] - linesM[i + 3 + k]));
    expect(length).toBeCloseTo(1);
  }
});

test('lines tell which element they are of', () => {
  const one = cube();
  const open = cube({ nFaces: 5 });
  const count = one.count + open.count;
  const cornersM = Float32Array.of(...one.cornersM, ...open.cornersM);
  const [first] = whole(one);
  const second = { ...first, firstTriangle: one.count, nTriangles: open.count };
  const { firstLine } = findEdges({ ...one, count, cornersM }, [first, { ...second, nTriangles: 0 }, second]);
  expect([...firstLine]).toEqual([0, 12, 12, 24]);
});

test('closed bodies tell which way their faces look', () => {
  expect(new Set(findEdges(cube(), whole(cube())).bodySide)).toEqual(new Set([1]));
  const turned = cube({ isInsideOut: true });
  expect(new Set(findEdges(turned, whole(turned)).bodySide)).toEqual(new Set([-1]));
});

test('a body that lacks a face is open, and its rim has lines', () => {
  const open = cube({ nFaces: 5 });
  const { bodySide, linesM } = findEdges(open, whole(open));
  expect(new Set(bodySide)).toEqual(new Set([0]));
  expect(linesM.length).toBe(12 * 6);
});

/** Lines and closedness by comparing all edges with all, as text; slow and plain. */
function edgesByText(cornersM: Float32Array): { lines: Set<string>; isClosed: boolean } {
  const corner = (i: number): string => [0, 1, 2].map((k) => cornersM[3 * i + k] + 0).join(' ');
  const normal = (t: number): number[] => {
    const n = normalOf(cornersM, t);
    return n.map((x) => x / Math.hypot(...n));
  };
  const met = new Map<string, { t: number; from: string }[]>();
  for (let t = 0; t < cornersM.length / 9; t++) {
    for (let k = 0; k < 3; k++) {
      const [a, b] = [corner(3 * t + k), corner(3 * t + ((k + 1) % 3))];
      if (a === b) continue;
      const key = [a, b].sort().join(' | ');
      met.set(key, [...(met.get(key) ?? []), { t, from: a }]);
    }
  }
  const lines = new Set<string>();
  let isClosed = true;
  for (const [key, [first, ...others]] of met) {
    const isPair = others.length === 1 && others[0].from !== first.from;
    isClosed &&= isPair;
    const isBent = others.some(({ t, from }) => {
      const [u, v] = [normal(first.t), normal(t)];
      const cos = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
      return Math.acos(Math.max(-1, Math.min(1, from === first.from ? -cos : cos))) > (25 * Math.PI) / 180;
    });
    if (others.length === 0 || isBent) lines.add(key);
  }
  return { lines, isClosed };
}

test.each([1, 2, 3, 4, 5, 6, 7, 8])('lines of a mesh on a grid are those of comparing all edges, seed %i', (seed) => {
  let state = seed;
  const next = (n: number): number => {
    state = (Math.imul(state, 1103515245) + 12345) & 0x7fffffff;
    return (state >> 8) % n;
  };
  // Few places, so that edges meet; 0 and -0 are one of them.
  const at = (): number => [0, -0, 1, 2][next(4)];
  const corners: number[] = [];
  while (corners.length < 9 * 30) {
    const nine = Array.from({ length: 9 }, at);
    if (Math.hypot(...normalOf(Float32Array.from(nine), 0)) > 0) corners.push(...nine);
  }
  const cornersM = Float32Array.from(corners);
  const triangles = { count: 30, cornersM } as unknown as StageTriangles;
  const { linesM, bodySide } = findEdges(triangles, whole(triangles));
  const found = new Set<string>();
  for (let i = 0; i < linesM.length; i += 6) {
    const ends = [0, 3].map((from) => [0, 1, 2].map((k) => linesM[i + from + k] + 0).join(' '));
    found.add(ends.sort().join(' | '));
  }
  const expected = edgesByText(cornersM);
  expect(found).toEqual(expected.lines);
  expect(bodySide[0] !== 0).toBe(expected.isClosed);
});
