import { expect, test } from 'vitest';
import { initials } from './people.tsx';

test.each([
  ['Ada', 'A'],
  ['Ada Lovelace', 'AL'],
  ['ada king  lovelace', 'AL'],
  ['Émile Ötvös', 'ÉÖ'],
  ['𝒜da', '𝒜'],
])('%s is %s', (name, letters) => {
  expect(initials(name)).toBe(letters);
});
