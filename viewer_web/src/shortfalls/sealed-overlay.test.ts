import type { BufferGeometry, Mesh } from 'three';
import { expect, test } from 'vitest';
import { cornersOf, SealedOverlay } from './sealed-overlay.ts';

const ROOM = [
  [
    [0, 0],
    [3, 2],
  ],
  [
    [0, 2],
    [1, 5],
  ],
] as const;

function areaM2(corners: Float32Array): number {
  let sum = 0;
  for (let i = 0; i < corners.length; i += 9) {
    const [ax, ay, , bx, by, , cx, cy] = corners.subarray(i, i + 9);
    sum += ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2;
  }
  return sum;
}

test('an area is filled with its own ground, at its own height', () => {
  const corners = cornersOf(ROOM, 1.25);
  expect(areaM2(corners)).toBeCloseTo(3 * 2 + 1 * 3, 5);
  expect(new Set(corners.filter((_, i) => i % 3 === 2))).toEqual(new Set([1.25]));
});

test('what was drawn before goes, and an area without outline is not filled', () => {
  const overlay = new SealedOverlay();
  const ground = { insideM: [1, 1, 0] as const, rectangles: ROOM, words: 'Not reachable' };
  overlay.set([ground]);
  overlay.set([ground, { ...ground, rectangles: [] }]);
  expect(overlay.group.children).toHaveLength(1);
  const [mesh] = overlay.group.children as Mesh<BufferGeometry>[];
  expect(mesh.geometry.attributes.position.count).toBe(12);
  overlay.dispose();
  expect(overlay.group.children).toHaveLength(0);
});
