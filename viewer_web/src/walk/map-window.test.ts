import { expect, test } from 'vitest';
import type { StageFloor } from '../load/stage.ts';
import { floorAt, mapWindow } from './map-window.ts';

test('a floor that fits is shown whole, wherever one stands', () => {
  const house = { minM: [0, -2, 0], maxM: [10, 6, 3] } as const;
  const whole = { x: -0.8, y: -6.8, width: 11.6, height: 9.6 };
  for (const eyeM of [
    [5, 2, 1.6],
    [99, -99, 1.6],
  ]) {
    for (const [side, value] of Object.entries(mapWindow(house, eyeM))) {
      expect(value).toBeCloseTo(whole[side as keyof typeof whole]);
    }
  }
});

test('of a large floor the map shows what is around one, up to its ends', () => {
  const hall = { minM: [0, 0, 0], maxM: [200, 20, 9] } as const;
  expect(mapWindow(hall, [100, 10, 2])).toMatchObject({ x: 82, width: 36 });
  expect(mapWindow(hall, [3, 10, 2]).x).toBeCloseTo(-0.8);
  expect(mapWindow(hall, [199, 10, 2]).x).toBeCloseTo(164.8);
});

test('where no ground is below, one is on the highest floor that is not above the feet', () => {
  const floors = [-3, 0, 2.8].map((elevationM) => ({ elevationM }) as StageFloor);
  expect([-9, -3, -0.5, 0, 1, 2.5, 7].map((feetM) => floorAt(feetM, floors)?.elevationM)).toEqual([
    -3, -3, -3, 0, 0, 2.8, 2.8,
  ]);
  expect(floorAt(0, [])).toBeUndefined();
});
