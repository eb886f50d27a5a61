import { expect, test } from 'vitest';
import { multiples, roundStepM, stepWords } from './ruler.ts';

test('steps are 1, 2 or 5 times a power of ten, no less than what is needed and less than two and a half times it', () => {
  for (let leastM = 0.013; leastM < 900; leastM *= 1.07) {
    for (const [unit, unitM] of [
      ['m', 1],
      ['ft', 0.3048],
    ] as const) {
      const step = roundStepM(leastM, unit);
      expect(step / leastM).toBeGreaterThanOrEqual(1 - 1e-9);
      expect(step / leastM).toBeLessThan(2.5 + 1e-9);
      // Its first digit, told by the number's own words.
      expect((step / unitM).toExponential(6)).toMatch(/^[125]\.000000e/);
    }
  }
  expect(roundStepM(1, 'm')).toBe(1);
  expect(stepWords(roundStepM(0.3, 'm'), 'm')).toBe('0.5 m');
  expect(stepWords(roundStepM(4, 'ft'), 'ft')).toBe('20 ft');
});

test('lines of the grid are at multiples of the step, ends included', () => {
  expect(multiples(2, -3, 4)).toEqual([-2, 0, 2, 4].map((x) => x + 0));
  expect(multiples(0.5, 0.6, 0.9)).toEqual([]);
});
