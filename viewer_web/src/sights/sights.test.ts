import { expect, test } from 'vitest';
import { sightsOf } from './sights.ts';

const NONE = { spacing_m: null, range_m: null, incidence_rad: null, noise_m: null };

const degrees = (rad: number): number => (rad * 180) / Math.PI;

test('ranges and incidences are those of set squares, from either side of the surface', () => {
  // A wall in the plane y = 0, seen at the origin; its normal need not have length 1.
  const sights = sightsOf(
    [
      { id: 'S001', positionM: [0, 4, 0], isCounted: true },
      { id: 'S002', positionM: [3, -3, 0], isCounted: true },
      { id: 'S003', positionM: [0, 1, Math.sqrt(3)], isCounted: true },
    ],
    [0, 0, 0],
    [0, 2, 0],
    NONE,
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
      { id: 'near', positionM: oblique, isCounted: true },
      { id: 'square', positionM: [0, 3, 0], isCounted: true },
      { id: 'far', positionM: [0, 9, 0], isCounted: true },
    ],
    [0, 0, 0],
    [0, 1, 0],
    NONE,
  );
  expect(sights.map(({ stationId }) => stationId)).toEqual(['square', 'near', 'far']);
  expect(sights.map(({ isBest }) => isBest)).toEqual([true, false, false]);
  expect(sightsOf([], [0, 0, 0], [0, 1, 0], NONE)).toEqual([]);
});

test('stations that are not counted come last, whatever is best, each with the limit that it misses', () => {
  const limits = { ...NONE, incidence_rad: 1, range_m: 5 };
  const shortfalls = (asked: typeof limits | typeof NONE) =>
    sightsOf(
      [
        { id: 'oblique', positionM: [1.8, 0.5, 0], isCounted: false },
        { id: 'far', positionM: [0, 5.5, 0], isCounted: false },
        { id: 'near', positionM: [0, 1, 0], isCounted: false },
        { id: 'counted', positionM: [0, 4, 0], isCounted: true },
      ],
      [0, 0, 0],
      [0, 1, 0],
      asked,
    ).map(({ stationId, isBest, shortfall }) => [stationId, isBest, shortfall]);
  expect(shortfalls(limits)).toEqual([
    ['counted', true, null],
    ['near', false, 'not as required'],
    ['far', false, 'out of range'],
    ['oblique', false, 'too oblique'],
  ]);
  const reasonOfNear = (asked: object) => shortfalls({ ...limits, ...asked })[1][2];
  expect(reasonOfNear({ spacing_m: 0.01 })).toBe('too sparse');
  expect(reasonOfNear({ noise_m: 0.01 })).toBe('too noisy');
  expect(reasonOfNear({ spacing_m: 0.01, noise_m: 0.01 })).toBe('not as required');
});

test('of stations none of which is counted, none is best', () => {
  const seeing = [{ id: 'S001', positionM: [0, 4, 0] as const, isCounted: false }];
  const [sight] = sightsOf(seeing, [0, 0, 0], [0, 1, 0], { ...NONE, incidence_rad: 1 });
  expect([sight.isBest, sight.shortfall]).toEqual([false, 'not as required']);
});
