import { afterEach, expect, test } from 'vitest';
import { units } from '../panels/units.ts';
import type { PointM } from './geometry.ts';
import type { MeasureKind } from './state.ts';
import { resultOf } from './words.ts';

const pointsOf = (places: readonly PointM[]) =>
  places.map((sceneM) => ({ sceneM, floorId: 'F0', on: 'corner' as const }));
const measured = (kind: MeasureKind, ...places: PointM[]) =>
  resultOf({ kind, points: pointsOf(places), isInPlan: false });
afterEach(() => {
  units.value = 'm';
});

test('results are told in metres to the millimetre, and in feet and inches', () => {
  const [a, b]: PointM[] = [
    [0, 0, 2],
    [3, 4, 0.5],
  ];
  expect(measured('distance', a, b)).toEqual({
    main: '5.220 m',
    rest: [
      ['Horizontal', '5.000 m'],
      ['Height difference', '−1.500 m'],
    ],
    warning: null,
  });
  expect(measured('height', b, a).main).toBe('1.500 m');
  units.value = 'ft';
  // 1.5 m are 59.055 inches: 4 feet and 11 inches, and less than half an eighth.
  expect(measured('height', b, a).main).toBe(`4' 11"`);
  expect(measured('area', [0, 0, 0], [0.3048, 0, 0], [0.3048, 3.048, 0], [0, 3.048, 0]).main).toBe('10.0 sq ft');
});

test('an angle has its plan beside it, an area its perimeter and what is odd about it', () => {
  expect(measured('angle', [1, 0, 1], [0, 0, 0], [0, 1, 1])).toEqual({
    main: '60.00°',
    rest: [['In plan', '90.00°']],
    warning: null,
  });
  expect(measured('area', [0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.2])).toMatchObject({
    rest: [['Perimeter', expect.stringMatching(/^8\.0/)]],
    warning: 'Corners are up to 0.05 m off one plane.',
  });
  expect(measured('area', [0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0]).warning).toBe('Sides cross: this is no area.');
});

test('what is measured in the plan view is told in plan, whatever heights its points are at', () => {
  const inPlan = (kind: MeasureKind, ...places: PointM[]) =>
    resultOf({ kind, points: pointsOf(places), isInPlan: true });
  expect(inPlan('distance', [0, 0, 2], [3, 4, 0.5])).toMatchObject({
    main: '5.000 m',
    rest: [['Straight', '5.220 m'], {}],
  });
  expect(inPlan('angle', [1, 0, 1], [0, 0, 0], [0, 1, 1])).toMatchObject({
    main: '90.00°',
    rest: [['In space', '60.00°']],
  });
  const [area, heights] = [
    inPlan('area', [0, 0, 0], [2, 0, 1.6], [2, 2, 0], [0, 2, 1.6]),
    inPlan('height', [0, 0, 1], [9, 0, 3]),
  ];
  expect(area).toEqual({ main: '4.00 m²', rest: [['Perimeter', '8.000 m']], warning: null });
  expect(heights.main).toBe('2.000 m');
});
