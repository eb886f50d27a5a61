import { expect, test } from 'vitest';
import { isPlanned } from './planned.ts';

const upper = { id: 'F1', name: 'Upper floor' };

test('a floor is planned where nothing is told, or where its id or name is', () => {
  expect(isPlanned(upper)).toBe(true);
  expect(isPlanned(upper, [])).toBe(true);
  expect(isPlanned(upper, ['f1'])).toBe(true);
  expect(isPlanned(upper, ['F0', 'upper Floor'])).toBe(true);
});

test('a floor is not planned where only others are told', () => {
  expect(isPlanned(upper, ['F0', 'Ground floor'])).toBe(false);
});
