import { expect, test } from 'vitest';
import { channelsOf, inkOn } from './ink.ts';
import { overlapColor, strengthColor } from './strength.ts';

/** Contrast by the table of the standard's own examples: #767676 on white is the darkest grey that just passes, 4.54. */
function contrast(a: string, b: string): number {
  const [x, y] = [a, b].map((color) => {
    const [r, g, bl] = channelsOf(color).map((one) =>
      one <= 10.31475 ? one / 255 / 12.92 : Math.exp(2.4 * Math.log((one / 255 + 0.055) / 1.055)),
    );
    return 0.2126 * r + 0.7152 * g + 0.0722 * bl + 0.05;
  });
  return Math.max(x, y) / Math.min(x, y);
}

test('figures in the cells of the matrix are read on every colour, on light pages and dark ones', () => {
  expect(contrast('#767676', '#ffffff')).toBeCloseTo(4.54, 2);
  for (const isDark of [false, true]) {
    const overlaps = Array.from({ length: 101 }, (_, i) => overlapColor(i / 100, isDark));
    const strengths = Array.from({ length: 101 }, (_, i) => strengthColor(i / 400, isDark));
    for (const color of [...overlaps, ...strengths, strengthColor(null, isDark)]) {
      expect(contrast(color, inkOn(color)), color).toBeGreaterThanOrEqual(4.5);
    }
  }
});

test('colours are read in both ways that they are written in', () => {
  expect(channelsOf('#b3262e')).toEqual([179, 38, 46]);
  expect(channelsOf('rgb(179 38 46)')).toEqual([179, 38, 46]);
});
