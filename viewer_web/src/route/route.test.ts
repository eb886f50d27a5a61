import { expect, test } from 'vitest';
import type { PlanRoute } from '../load/plan-json.ts';
import type { StageFloor } from '../load/stage.ts';
import { missesEntrance, segmentsOf, stopsOf } from './route.ts';

const FLOORS = [
  { id: 'F0', elevationM: 0 },
  { id: 'F1', elevationM: 3 },
] as StageFloor[];
const ROUTE: PlanRoute = {
  length_m: 20,
  n_unwalkable: 0,
  exact: true,
  start: null,
  end: null,
  returns: false,
  order: ['S001', 'S002', 'S003'],
  left_out: [],
  legs: [
    {
      from: null,
      to: 'S001',
      length_m: 2,
      floors: ['F0'],
      points: [
        [100, 50, 10],
        [101, 50, 10],
        [102, 50, 10],
      ],
    },
    {
      from: 'S001',
      to: 'S002',
      length_m: 8,
      floors: ['F0', 'F1'],
      points: [
        [102, 50, 10],
        [104, 50, 11.5],
        [106, 50, 12.9],
      ],
    },
    { from: 'S002', to: 'S003', length_m: null, floors: ['F1'], points: [] },
  ],
};

test('a route is local lines just over the ground, each end with the floor it lies on', () => {
  const segments = segmentsOf(ROUTE, [100, 50, 10], FLOORS);
  expect(segments.map(({ leg }) => leg)).toEqual([0, 0, 1, 1]);
  expect(segments[0].fromM[0]).toBe(0);
  expect(segments[0].fromM[2]).toBeGreaterThan(0);
  expect(segments[0].fromM[2]).toBeLessThan(0.1);
  expect(segments.map(({ fromFloor, toFloor }) => fromFloor + toFloor)).toEqual(['F0F0', 'F0F0', 'F0F0', 'F0F1']);
});

test('stops tell the way to each station', () => {
  const stops = stopsOf(ROUTE);
  expect(stops.map(({ lengthM }) => lengthM)).toEqual([2, 8, null]);
  expect(stops.map(({ changesFloor }) => changesFloor)).toEqual([false, true, false]);
  expect(stops.map(({ from }) => from)).toEqual([null, 'S001', 'S002']);
  const unled = stopsOf({ ...ROUTE, legs: ROUTE.legs.slice(1) });
  expect(unled[0]).toMatchObject({ leg: null, lengthM: 0 });
});

test('a route of the draft that does not begin at its entrance is told from one that was given none', () => {
  expect(missesEntrance(ROUTE, 1)).toBe(true);
  expect(missesEntrance(ROUTE, 0)).toBe(false);
  expect(missesEntrance({ ...ROUTE, start: [102, 50, 10] }, 1)).toBe(false);
  expect(missesEntrance(null, 1)).toBe(false);
});
