import { expect, test } from 'vitest';
import { findEdges } from './edges.ts';
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
  { sceneIndex: 0, name: 'cube', kind: 'Mesh', floorId: '', firstTriangle: 0, nTriangles: triangles.count },
];

test('a cube has twelve lines and none along the diagonals of its faces', () => {
  const { linesM } = findEdges(cube(), whole(cube()));
  expect(linesM.length).toBe(12 * 6);
  for (let i = 0; i < linesM.length; i += 6) {
    const length = Math.hypot(...[0, 1, 2].map((k) => linesM[i + k] - linesM[i + 3 + k]));
    expect(length).toBeCloseTo(1);
  }
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
