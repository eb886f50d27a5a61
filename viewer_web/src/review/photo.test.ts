import { expect, test } from 'vitest';
import { fitted, LONGEST_EDGE } from './photo.tsx';

test.each([
  [4000, 3000, 1600, 1200],
  [3000, 4000, 1200, 1600],
  [1600, 900, 1600, 900],
  [40, 30, 40, 30],
  [20000, 3, 1600, 1],
])('a photo of %i x %i becomes one of %i x %i', (width, height, ...small) => {
  expect(fitted(width, height)).toEqual(small);
  expect(Math.max(...fitted(width, height))).toBeLessThanOrEqual(LONGEST_EDGE);
});
