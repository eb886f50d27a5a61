import { expect, test } from 'vitest';
import { type Curve, pointsOf, scaleOf, stationTicks } from './curve.ts';

const FRAME = { width: 130, height: 120, left: 20, bottom: 10, top: 10, right: 10 };
const curve = (...fractions: (number | null)[]): Curve => ({ title: 'plan', fractions, look: 'shown' });

test('a curve begins at nothing and ends where its last station is', () => {
  const scale = scaleOf([curve(0.5, 1), curve(0.2, 0.4, 0.6, 0.8, 1)], FRAME);
  expect(scale.mostStations).toBe(5);
  expect(pointsOf(curve(0.5, 1), scale)).toBe('20.0,110.0 40.0,60.0 60.0,10.0');
});

test('a step that is not known is left out', () => {
  const scale = scaleOf([curve(0.5, null, 1)], FRAME);
  expect(pointsOf(curve(0.5, null, 1), scale).split(' ')).toHaveLength(3);
});

test.each([
  [1, [0, 1]],
  [4, [0, 1, 2, 3, 4]],
  [28, [0, 10, 20]],
  [23, [0, 5, 10, 15, 20]],
  [640, [0, 200, 400, 600]],
])('an axis of %i stations has ticks %j', (most, ticks) => {
  expect(stationTicks(most)).toEqual(ticks);
});
