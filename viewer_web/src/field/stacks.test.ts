import { expect, test } from 'vitest';
import type { Stop } from './route.ts';
import { shownOf, stacksOf } from './stacks.ts';

const stop = (order: number, x: number, y: number, z = 1.5): Stop => ({
  stationId: `S00${order}`,
  number: order,
  floorId: 'F0',
  floorName: 'Ground floor',
  heightM: z,
  positionM: [x, y, z],
  wayM: null,
  way: [],
  isWithoutWay: false,
});

test('stations at one spot at several heights are one stack, others stand alone', () => {
  const stops = [stop(1, 0, 0), stop(2, 3, 0), stop(3, 0, 0, 1.9), stop(4, 0.2, 0.1, 2.3), stop(5, 0.6, 0)];
  const stacks = stacksOf(stops, 0.5);
  expect(stacks.map((stack) => stack.map(({ number }) => number))).toEqual([[1, 3, 4], [2], [5]]);
});

test('stacks stand further apart than they reach, so that none hides another', () => {
  const stops = [...Array(60).keys()].map((i) => stop(i, (i * 7919) % 13, ((i * 104729) % 17) / 2));
  const stacks = stacksOf(stops, 1.2);
  expect(stacks.flat().length).toBe(60);
  for (const [i, [a]] of stacks.entries()) {
    for (const [b] of stacks.slice(i + 1)) {
      expect(Math.hypot(a.positionM[0] - b.positionM[0], a.positionM[1] - b.positionM[1])).toBeGreaterThanOrEqual(1.2);
    }
  }
});

test('a stack shows the next of the walk, else what is still to do', () => {
  const stack = [stop(1, 0, 0), stop(3, 0, 0), stop(4, 0, 0)];
  const shown = (next: Stop | null, ...done: string[]): number => shownOf(stack, next, new Set(done)).number;
  expect(shown(stack[2])).toBe(4);
  expect(shown(stop(9, 5, 5), 'S001')).toBe(3);
  expect(shown(null, 'S001', 'S003', 'S004')).toBe(1);
});
