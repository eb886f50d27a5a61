import { expect, test } from 'vitest';
import type { Place } from './ground-map.ts';
import { areaM2, faultOf, isInside } from './outline.ts';

const SQUARE: Place[] = [
  [0, 0],
  [2, 0],
  [2, 2],
  [0, 2],
];

test('an outline has the area of its polygon, in either direction', () => {
  expect(areaM2(SQUARE)).toBe(4);
  expect(areaM2([...SQUARE].reverse())).toBe(4);
  expect(areaM2(SQUARE.slice(0, 3))).toBe(2);
});

test('a place is inside an outline that winds around it, bays left out', () => {
  const bay: Place[] = [
    [0, 0],
    [4, 0],
    [4, 3],
    [2, 1],
    [0, 3],
  ];
  const inside: Place[] = [
    [0.5, 2],
    [3.5, 2],
    [2, 0.5],
  ];
  const outside: Place[] = [
    [2, 2],
    [5, 1],
    [-1, 1],
    [2, -1],
  ];
  for (const outline of [bay, [...bay].reverse()]) {
    expect(inside.map((place) => isInside(outline, place))).toEqual([true, true, true]);
    expect(outside.map((place) => isInside(outline, place))).toEqual([false, false, false, false]);
  }
});

test.each([
  [[], /3 more corners/],
  [SQUARE.slice(0, 2), /1 more corner on/],
  [[SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]], /crosses itself/],
  // A corner that lies on another side.
  [[...SQUARE, [1, 0]], /crosses itself/],
  [SQUARE.map(([x, y]) => [x / 20, y / 20]), /hardly any area/],
] as [Place[], RegExp][])('what is wrong with %j is told', (outline, words) => {
  expect(faultOf(outline)).toMatch(words);
});

test('outlines that are areas are taken, bent inwards too', () => {
  expect(faultOf(SQUARE)).toBeNull();
  expect(faultOf([...SQUARE, [1, 1]])).toBeNull();
});
