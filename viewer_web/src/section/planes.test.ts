import { expect, test } from 'vitest';
import { BOX_SIDES, facingOf, isKept, keptOfRay, planeOfLine, planesOfBox, THINNEST_M, withSide } from './planes.ts';

const BOX = { minM: [0, -1, 0.5], maxM: [4, 2, 3] } as const;

test('a box keeps what is inside it, as comparing coordinates says', () => {
  const planes = planesOfBox(BOX);
  for (const x of [-0.5, 0.1, 3.9, 4.5]) {
    for (const y of [-1.5, 0, 2.5]) {
      for (const z of [0, 1, 3.1]) {
        const isInside = x >= 0 && x <= 4 && y >= -1 && y <= 2 && z >= 0.5 && z <= 3;
        expect(isKept(planes, [x, y, z]), `${x} ${y} ${z}`).toBe(isInside);
      }
    }
  }
});

test('of a ray the part inside the box is left', () => {
  const planes = planesOfBox(BOX);
  expect(keptOfRay(planes, [-2, 0, 1], [1, 0, 0], 0, 100)).toEqual([2, 6]);
  expect(keptOfRay(planes, [1, 0, 1], [0, 0, 1], 0, 100)).toEqual([0, 2]);
  expect(keptOfRay(planes, [-2, 5, 1], [1, 0, 0], 0, 100)).toBeNull();
  expect(keptOfRay(planes, [-2, 0, 1], [-1, 0, 0], 0, 100)).toBeNull();
  // A ray along a diagonal, checked by its ends: both lie on sides of the box.
  const k = Math.SQRT1_2;
  const [near, far] = keptOfRay(planes, [-1, -1, 1], [k, k, 0], 0, 100)!;
  expect([near * k - 1, far * k - 1]).toEqual([expect.closeTo(0), expect.closeTo(2)]);
});

test('a line keeps what is to its left, and flipped what is to its right', () => {
  // Eastwards along y = 2: to the left is north.
  const line = { fromM: [0, 2], toM: [5, 2], isFlipped: false } as const;
  expect(facingOf(line)).toEqual([-0, 1]);
  expect(isKept([planeOfLine(line)], [100, 2.5, 0])).toBe(true);
  expect(isKept([planeOfLine(line)], [100, 1.5, 0])).toBe(false);
  expect(isKept([planeOfLine({ ...line, isFlipped: true })], [100, 1.5, 0])).toBe(true);
  // Askew: the signed area of the triangle says on which side a point lies.
  const askew = { fromM: [1, 1], toM: [4, 3], isFlipped: false } as const;
  for (const [x, y] of [
    [0, 0],
    [3, 1],
    [1, 4],
    [5, 3],
  ]) {
    const area = (4 - 1) * (y - 1) - (3 - 1) * (x - 1);
    expect(isKept([planeOfLine(askew)], [x, y, 9])).toBe(area >= 0);
  }
});

test('a side of the box goes where it is put, and stops short of the side across', () => {
  const [, east] = BOX_SIDES;
  expect(withSide(BOX, east, 2.5).maxM).toEqual([2.5, 2, 3]);
  expect(withSide(BOX, east, -7).maxM[0]).toBeCloseTo(THINNEST_M);
  expect(withSide(BOX, BOX_SIDES[4], 9).minM[2]).toBeCloseTo(3 - THINNEST_M);
  expect(withSide(BOX, east, 2.5).minM).toEqual(BOX.minM);
});
