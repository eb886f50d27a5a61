import { expect, test } from 'vitest';
import { timeInWords } from './conflict-words.ts';

test('a time has its date, of today too, and what is no time stays as it is', () => {
  expect(timeInWords('2026-11-03T14:05:00')).toBe('on 3 Nov 2026 at 14:05');
  const today = new Date();
  expect(timeInWords(today.toISOString())).toMatch(new RegExp(`^on ${today.getDate()} .*${today.getFullYear()} at `));
  expect(timeInWords('some day')).toBe('some day');
});
