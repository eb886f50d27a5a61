import { afterEach, expect, test } from 'vitest';
import { units } from '../panels/units.ts';
import { scaleBar } from './scale-bar.ts';

afterEach(() => {
  units.value = 'm';
});

test.each([
  [0.01, '1 m', 100],
  [0.05, '5 m', 100],
  [0.049, '2 m', 40.8],
  [0.003, '0.2 m', 66.7],
  [3, '200 m', 66.7],
])('at %s m a pixel the bar is %s', (metresPerPixel, words, lengthPx) => {
  const bar = scaleBar(metresPerPixel, 100);
  expect(bar.words.replace(/\s/g, ' ')).toBe(words);
  expect(bar.lengthPx).toBeCloseTo(lengthPx, 1);
});

test('in feet the bar is a round number of feet', () => {
  units.value = 'ft';
  expect(scaleBar(0.3048 / 10, 100).lengthPx).toBeCloseTo(100, 6);
});
