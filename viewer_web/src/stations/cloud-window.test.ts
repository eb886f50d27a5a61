import { expect, test } from 'vitest';
import { shareOfScan, windowOf } from './cloud-window.ts';

const at = (azimuthDeg: number, elevationDeg: number, range = 5): [number, number, number] => {
  const [azimuth, elevation] = [azimuthDeg, elevationDeg].map((deg) => (deg * Math.PI) / 180);
  const flat = range * Math.cos(elevation);
  return [10 + flat * Math.cos(azimuth), 20 + flat * Math.sin(azimuth), 1.5 + range * Math.sin(elevation)];
};
const SENSOR = [10, 20, 1.5] as const;
const degrees = (window: ReturnType<typeof windowOf>) =>
  window &&
  [window.azimuthRad, window.widthRad, window.lowRad, window.highRad].map((rad) => Math.round((rad * 180) / Math.PI));

test('a window holds what is looked at, and a tenth more on every side', () => {
  expect(degrees(windowOf(SENSOR, [at(20, -10), at(40, 10), at(30, 0)], 50))).toEqual([18, 24, -12, 12]);
});

test('a window across the end of a turn is as narrow as any other', () => {
  expect(degrees(windowOf(SENSOR, [at(170, 0), at(-170, 20), at(180, 10)], 50))).toEqual([168, 24, -2, 22]);
});

test('what is all around is a whole turn, and elevations end at the zenith', () => {
  const around = [0, 90, 180, 270].map((deg) => at(deg, 85));
  const window = windowOf(SENSOR, [...around, at(45, -80), at(135, 0), at(225, 0), at(315, 0)], 50)!;
  expect(window.widthRad).toBeGreaterThan(5.4);
  expect(window.highRad).toBeLessThanOrEqual(Math.PI / 2);
});

test('what the scanner does not reach makes no window', () => {
  expect(windowOf(SENSOR, [at(0, 0, 60), at(10, 0, 70)], 50)).toBeNull();
  expect(windowOf(SENSOR, [], 50)).toBeNull();
});

test('the share of a scan goes by width and by rows', () => {
  const rows = Float32Array.of(0.3, 0.1, -0.1, -0.3);
  expect(shareOfScan({ azimuthRad: 0, widthRad: Math.PI, lowRad: -0.2, highRad: 0.2 }, rows)).toBeCloseTo(0.25);
});
