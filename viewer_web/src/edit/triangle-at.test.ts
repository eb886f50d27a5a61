import { expect, test } from 'vitest';
import { triangleAt } from './triangle-at.ts';

/** Unit triangles in the planes z = 0, 1, 2. */
const STACK = Float32Array.from([0, 1, 2].flatMap((z) => [0, 0, z, 1, 0, z, 0, 1, z]));

test.each([
  [[0.2, 0.2, 1], 1],
  [[0.2, 0.2, 1.04], 1],
  [[0.2, 0.2, 1.96], 2],
  [[-0.03, 0.5, 0], 0], // beside a side
  [[0.53, 0.53, 2], 2], // beside the slanting side
  [[0.2, 0.2, 1.5], null],
  [[-0.06, 0.5, 0], null],
  [[0.6, 0.6, 2], null],
] as [[number, number, number], number | null][])('the point %j lies on triangle %s', (point, triangle) => {
  expect(triangleAt(STACK, point)).toBe(triangle);
});

test('of two triangles in reach the nearer one counts', () => {
  const pair = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.06, 1, 0, 0.06, 0, 1, 0.06]);
  expect([triangleAt(pair, [0.2, 0.2, 0.02]), triangleAt(pair, [0.2, 0.2, 0.04])]).toEqual([0, 1]);
});

test('a triangle without area is near its corners', () => {
  const flat = Float32Array.from([0, 0, 0, 1, 0, 0, 2, 0, 0]);
  expect(triangleAt(flat, [1.5, 0.02, 0])).toBe(0);
});
