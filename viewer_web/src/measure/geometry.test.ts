import { expect, test } from 'vitest';
import { angleOf, areaOf, distanceOf, type PointM } from './geometry.ts';

const degrees = (rad: number | null): number => (rad === null ? Number.NaN : (rad * 180) / Math.PI);
/** Easting and northing of a real site: what is measured must not lose its millimetres there. */
const FAR: PointM = [512_345.678, 5_412_345.678, 230];
const moved = ([x, y, z]: PointM): PointM => [x + FAR[0], y + FAR[1], z + FAR[2]];

test('a distance is the edge of a box of 2, 3 and 6 metres: 7 m, of which the height is signed', () => {
  const found = distanceOf(FAR, moved([2, 3, -6]));
  expect(found.straightM).toBeCloseTo(7, 6);
  expect(found.levelM).toBeCloseTo(Math.sqrt(13), 6);
  expect(found.riseM).toBeCloseTo(-6, 6);
});

test('angles are those of a set square, in space and in plan', () => {
  expect(degrees(angleOf([1, 0, 0], [0, 0, 0], [0, 5, 0]).angleRad)).toBeCloseTo(90);
  expect(degrees(angleOf(moved([1, 0, 0]), FAR, moved([1, Math.sqrt(3), 0])).angleRad)).toBeCloseTo(60, 4);
  // A roof of 45 degrees over a right corner: 60 degrees between the rafters, 90 in plan.
  const roof = angleOf([1, 0, 1], [0, 0, 0], [0, 1, 1]);
  expect([degrees(roof.angleRad), degrees(roof.inPlanRad)]).toEqual([expect.closeTo(60), expect.closeTo(90)]);
  expect(angleOf([0, 0, 2], [0, 0, 0], [1, 0, 0]).inPlanRad).toBeNull();
  expect(degrees(angleOf([-2, 0, 0], [0, 0, 0], [1, 1e-7, 0]).angleRad)).toBeCloseTo(180, 4);
});

test('the area of an L is that of its two rectangles, however it lies in space', () => {
  // 5 x 3 without its corner of 3 x 2.
  const outline: (readonly [number, number])[] = [
    [0, 0],
    [5, 0],
    [5, 1],
    [2, 1],
    [2, 3],
    [0, 3],
  ];
  const flat = outline.map(([u, v]): PointM => [u, v, 0]);
  const upright = outline.map(([u, v]): PointM => [u * 0.6, u * 0.8, v]);
  for (const corners of [flat, flat.map(moved), upright.map(moved)]) {
    const found = areaOf(corners);
    expect(found.areaM2).toBeCloseTo(9, 5);
    expect(found.perimeterM).toBeCloseTo(16, 5);
    expect(found.offPlaneM).toBeLessThan(1e-6);
    expect(found.isCrossed).toBe(false);
  }
});

test('corners off their plane are told, and sides that cross', () => {
  // One corner of a square 0.4 m up: the plane that fits it passes 0.1 m above or below all four.
  const warped = areaOf([
    [0, 0, 0],
    [100, 0, 0],
    [100, 100, 0],
    [0, 100, 0.4],
  ]);
  expect(warped.offPlaneM).toBeCloseTo(0.1, 4);
  const bow: PointM[] = [
    [0, 0, 1],
    [2, 2, 1],
    [2, 0, 1],
    [0, 2, 1],
  ];
  expect(areaOf(bow).isCrossed).toBe(true);
});
