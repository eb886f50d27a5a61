import { expect, test } from 'vitest';
import { sightsOf } from './sights.ts';

const degrees = (rad: number): number => (rad * 180) / Math.PI;

test('ranges and incidences are those of set squares, from either side of the surface', () => {
  // A wall in the plane y = 0, seen at the origin; its normal need not have length 1.
  const sights = sightsOf(
    [
      { id: 'S001', positionM: [0, 4, 0] },
      { id: 'S002', positionM: [3, -3, 0] },
      { id: 'S003', positionM: [0, 1, Math.sqrt(3)] },
    ],
    [0, 0, 0],
    [0, 2, 0],
  );
  const byId = Object.fromEntries(sights.map((sight) => [sight.stationId, sight]));
  expect([byId.S001.rangeM, degrees(byId.S001.incidenceRad)]).toEqual([4, expect.closeTo(0)]);
  expect([byId.S002.rangeM, degrees(byId.S002.incidenceRad)]).toEqual([expect.closeTo(4.2426, 4), expect.closeTo(45)]);
  expect([byId.S003.rangeM, degrees(byId.S003.incidenceRad)]).toEqual([expect.closeTo(2), expect.closeTo(60)]);
});

test('the best samples the surface most closely: near is not best where it looks along the wall', () => {
  // 1 m off at 80 degrees is 5.8 m of squarely seen range; 3 m squarely is better.
  const oblique = [Math.sin((80 * Math.PI) / 180), Math.cos((80 * Math.PI) / 180), 0] as const;
  const sights = sightsOf(
    [
      { id: 'near', positionM: oblique },
      { id: 'square', positionM: [0, 3, 0] },
      { id: 'far', positionM: [0, 9, 0] },
    ],
    [0, 0, 0],
    [0, 1, 0],
  );
  expect(sights.map(({ stationId }) => stationId)).toEqual(['square', 'near', 'far']);
  expect(sights.map(({ isBest }) => isBest)).toEqual([true, false, false]);
  expect(sightsOf([], [0, 0, 0], [0, 1, 0])).toEqual([]);
});
