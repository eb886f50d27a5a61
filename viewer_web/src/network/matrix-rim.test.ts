import { expect, test } from 'vitest';
import { rimOf } from './matrix-rim.ts';

test.each([1, 2, 9, 24, 28, 40, 75, 300])(
  'numbers of %i stations do not run into each other, nor over the rim',
  (n) => {
    for (const widthPx of [308, 520]) {
      const nFigures = String(n).length;
      const { width, fontSize, gap, isNumbered } = rimOf(n, widthPx, nFigures);
      const cellPx = widthPx / (n + width);
      // Ten pixels of type need more than that from line to line; figures of such type are about six wide.
      expect(fontSize * cellPx).toBeCloseTo(10, 6);
      expect(width * cellPx).toBeGreaterThanOrEqual(6 * nFigures + gap * cellPx);
      for (const pointed of [undefined, 0, n >> 1, n - 1]) {
        const places = [...Array(n).keys()].filter((i) => i === pointed || isNumbered(i, pointed));
        const apartPx = places.slice(1).map((place, i) => (place - places[i]) * cellPx);
        expect(Math.min(...apartPx)).toBeGreaterThanOrEqual(11);
        // And no more are left out than must be.
        expect(places.length).toBeGreaterThanOrEqual(Math.min(n, (n * cellPx) / 40));
      }
    }
  },
);

test('where there is room every station has its number', () => {
  const isWhole = (n: number, widthPx: number): boolean => {
    const { isNumbered } = rimOf(n, widthPx, 2);
    return [...Array(n).keys()].every((i) => isNumbered(i, undefined));
  };
  expect(isWhole(20, 308)).toBe(true);
  expect(isWhole(28, 520)).toBe(true);
  expect(isWhole(75, 308)).toBe(false);
});
