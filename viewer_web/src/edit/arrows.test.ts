import { expect, test } from 'vitest';
import { trianglesOf } from './arrows.ts';

const corners = (numbers: number[]): number[][] =>
  Array.from({ length: numbers.length / 3 }, (_, i) => numbers.slice(3 * i, 3 * i + 3));

test('an arrow begins where the station stood and ends where it stands', () => {
  const drawn = corners(trianglesOf({ kind: 'moved', fromM: [1, 2, 3], toM: [4, 6, 3] }));
  expect(drawn.at(-1)).toEqual([4, 6, 3]);
  // Along the way, nothing lies before its start or past its tip.
  const along = drawn.map(([x, y]) => ((x - 1) * 3 + (y - 2) * 4) / 5);
  expect(Math.min(...along)).toBeCloseTo(0, 9);
  expect(Math.max(...along)).toBeCloseTo(5, 9);
});

test('a short arrow has a head shorter than itself', () => {
  const drawn = corners(trianglesOf({ kind: 'moved', fromM: [0, 0, 0], toM: [0.1, 0, 0] }));
  for (const [x] of drawn) expect(x >= -1e-9 && x <= 0.1 + 1e-9).toBe(true);
});

test('a station that was only raised has no arrow', () => {
  expect(trianglesOf({ kind: 'moved', fromM: [1, 1, 1], toM: [1, 1, 2] })).toEqual([]);
});

test('new and gone stations are marked around where they are', () => {
  for (const kind of ['new', 'gone'] as const) {
    const drawn = corners(trianglesOf({ kind, atM: [5, 5, 1] }));
    expect(drawn).toHaveLength(12);
    const middle = [0, 1].map((k) => drawn.reduce((sum, corner) => sum + corner[k], 0) / drawn.length);
    expect(middle[0]).toBeCloseTo(5, 9);
    expect(middle[1]).toBeCloseTo(5, 9);
  }
});
