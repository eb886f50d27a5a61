import { expect, test } from 'vitest';
import type { StageFloor, StageTriangles } from '../load/stage.ts';
import { type Extent, extentOf, extentsOf, floorBeside, sliceOfFloor, slicesOf } from './cut.ts';

const floor = (index: number, elevationM: number, topM: number): StageFloor => ({
  id: `F${index}`,
  name: `Floor ${index}`,
  index,
  elevationM,
  topM,
  groundAreaM2: 50,
});
const FLOORS = [floor(0, 0, 2.8), floor(1, 2.8, 5.6), floor(2, 5.6, 6.4)];
const GROUND: Extent = { minM: [2, 2, 0], maxM: [6, 5, 0] };
const EXTENT: Extent = { minM: [0, 0, -0.5], maxM: [10, 8, 6.4] };

test('one floor is cut above, and what lies below its slab is hidden', () => {
  const [slice, ...others] = slicesOf(
    { floorId: 'F1', isSpread: true, cutM: 1.5, hidesCeilings: false },
    FLOORS,
    EXTENT,
  );
  expect(others).toEqual([]);
  expect(slice.topM).toBeCloseTo(4.3);
  expect(slice.bottomM).toBeLessThan(2.8);
  expect(slice.bottomM).toBeGreaterThan(2.3);
  expect(slice.liftM).toBe(0);
});

test('the cut never reaches into the floor above', () => {
  expect(
    slicesOf({ floorId: 'F2', isSpread: false, cutM: 1.6, hidesCeilings: false }, FLOORS, EXTENT)[0].topM,
  ).toBeCloseTo(6.4);
});

test('all floors without spreading is the whole building, uncut', () => {
  const slices = slicesOf({ floorId: null, isSpread: false, cutM: 1.5, hidesCeilings: false }, FLOORS, EXTENT);
  expect(slices).toEqual([{ floorId: null, bottomM: -Infinity, topM: Infinity, liftM: 0, ceilingM: Infinity }]);
  expect(extentOf(slices, EXTENT, new Map([['F0', GROUND]]))).toEqual(EXTENT);
});

test('spread floors do not overlap and stay in order', () => {
  const slices = slicesOf({ floorId: null, isSpread: true, cutM: 1.5, hidesCeilings: false }, FLOORS, EXTENT);
  expect(slices.map((slice) => slice.floorId)).toEqual(['F0', 'F1', 'F2']);
  for (let i = 1; i < slices.length; i++) {
    expect(slices[i].bottomM + slices[i].liftM).toBeGreaterThan(slices[i - 1].topM + slices[i - 1].liftM);
  }
  expect(extentOf(slices, EXTENT, new Map()).maxM[2]).toBeCloseTo(6.4 + slices[2].liftM);
});

test('the picture of one floor is fitted to its ground', () => {
  const slices = slicesOf({ floorId: 'F0', isSpread: true, cutM: 1.5, hidesCeilings: false }, FLOORS, EXTENT);
  const { minM, maxM } = extentOf(slices, EXTENT, new Map([['F0', GROUND]]));
  expect(minM[0]).toBeGreaterThan(1);
  expect(minM[0]).toBeLessThanOrEqual(2);
  expect(maxM[1]).toBeGreaterThanOrEqual(5);
  expect(maxM[1]).toBeLessThan(6);
  expect(maxM[2]).toBeCloseTo(1.5);
});

test('extents are those of all triangles, and of each floor that has ground', () => {
  const cornersM = Float32Array.of(0, 0, 0, 4, 0, 0, 0, 3, 0, -1, 0, 2, 1, 7, 2, 0, 0, 9);
  const triangles = { count: 2, cornersM, groundOf: Uint8Array.of(1, 0) } as unknown as StageTriangles;
  const { whole, grounds } = extentsOf({ triangles, floors: FLOORS });
  expect([whole.minM, whole.maxM]).toEqual([
    [-1, 0, 0],
    [4, 7, 9],
  ]);
  expect([...grounds.keys()]).toEqual(['F0']);
  expect(grounds.get('F0')?.maxM).toEqual([4, 3, 0]);
});

test('an unknown floor and a plan without floors show the whole building', () => {
  expect(
    slicesOf({ floorId: 'F9', isSpread: false, cutM: 1, hidesCeilings: false }, FLOORS, EXTENT)[0].floorId,
  ).toBeNull();
  expect(slicesOf({ floorId: null, isSpread: true, cutM: 1, hidesCeilings: false }, [], EXTENT)[0].floorId).toBeNull();
});

test('stations of floors that are not shown have no slice', () => {
  const slices = slicesOf({ floorId: 'F1', isSpread: false, cutM: 1, hidesCeilings: false }, FLOORS, EXTENT);
  expect(sliceOfFloor(slices, 'F1')).toBe(slices[0]);
  expect(sliceOfFloor(slices, 'F0')).toBeUndefined();
});

test('stepping through floors starts at all and stops at the ends', () => {
  expect(floorBeside(null, 1, FLOORS)).toBe('F0');
  expect(floorBeside('F0', 1, FLOORS)).toBe('F1');
  expect(floorBeside('F2', 1, FLOORS)).toBe('F2');
  expect(floorBeside('F0', -1, FLOORS)).toBeNull();
  expect(floorBeside(null, -1, FLOORS)).toBeNull();
});

test('a cut lies off the faces at its own height, and over the highest floor above all of it', () => {
  const topOf = (floorId: string, cutM: number): number =>
    slicesOf({ floorId, isSpread: false, cutM, hidesCeilings: false }, FLOORS, EXTENT)[0].topM;
  expect(topOf('F0', 99)).toBeLessThan(2.8);
  expect(topOf('F0', 1.5)).not.toBe(1.5);
  expect(topOf('F2', 99)).toBeGreaterThan(6.4);
});

test('hidden ceilings are those of each floor that is shown, of the whole building those of the highest', () => {
  const ceilings = (floorId: string | null, isSpread: boolean): number[] =>
    slicesOf({ floorId, isSpread, cutM: 9, hidesCeilings: true }, FLOORS, EXTENT).map(({ ceilingM }) => ceilingM);
  expect(ceilings('F0', false)[0]).toBeGreaterThan(1.5);
  expect(ceilings('F0', false)[0]).toBeLessThan(2.4);
  expect(ceilings(null, true)).toHaveLength(3);
  expect(ceilings(null, false)[0]).toBeGreaterThan(5.6);
});
