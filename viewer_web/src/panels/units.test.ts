import { afterEach, expect, test } from 'vitest';
import { quantity } from '../heat/quantity.ts';
import { areaWords, coordinatesWords, coordinateWords, heightWords, lengthWords, unitName } from './figures.ts';
import { chooseUnits, feetAndInches, parseLengthM, restoreUnits, units } from './units.ts';

function storage(): { getItem: (key: string) => string | null; setItem: (key: string, value: string) => void } {
  const kept = new Map<string, string>();
  return { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => void kept.set(key, value) };
}

afterEach(() => {
  units.value = 'm';
});

// The figures of tests/model/test_length_units.py: 1 in is 25.4 mm.
test.each([
  [1.6002, `5' 3"`],
  [1.6129, `5' 3 1/2"`],
  [1.5, `4' 11"`],
  [0, `0' 0"`],
  [0.3047, `1' 0"`],
  [0.01905, `0' 0 3/4"`],
  [-1.6002, `−5' 3"`],
])('%f m is %s', (metres, words) => {
  expect(feetAndInches(metres)).toBe(words);
});

test('metres are shown until feet are chosen, and again after', () => {
  const shown = () => [lengthWords(1.6129), lengthWords(30.48, 0), areaWords(9.290304), coordinateWords(3.048, 3)];
  expect(shown()).toEqual(['1.61 m', '30 m', '9.3 m²', '3.048 m']);
  units.value = 'ft';
  expect(shown()).toEqual([`5' 3 1/2"`, '100 ft', '100.0 sq ft', '10.000 ft']);
  expect([lengthWords(1.6129, 1), heightWords(null), heightWords(1.6002)]).toEqual([`5' 4"`, 'not known', `5' 3"`]);
  expect([coordinatesWords([3.048, -0.3048, 30.48]), unitName()]).toEqual(['10.00, -1.00, 100.00', 'feet']);
  units.value = 'm';
  expect(shown()[0]).toBe('1.61 m');
  expect([coordinatesWords([3.048, -0.3048]), unitName()]).toEqual(['3.05, -0.30', 'metres']);
});

test('ranges are in feet, spacings in inches', () => {
  units.value = 'ft';
  expect(quantity(3.048, 'm')).toBe('10 ft');
  expect(quantity(0.00635, 'm')).toBe('0.25 in');
  expect(quantity(0, 'm', 5)).toBe('0 ft');
  expect(quantity(36.6, 'deg')).toBe('37°');
});

test('the browser keeps what was chosen', () => {
  const kept = storage();
  restoreUnits(kept);
  expect(units.value).toBe('m');
  chooseUnits(kept, 'ft');
  units.value = 'm';
  restoreUnits(kept);
  expect(units.value).toBe('ft');
  kept.setItem('tlsplan-units', 'furlongs');
  restoreUnits(kept);
  expect(units.value).toBe('m');
});

test('a typed length is read in the chosen unit, with either decimal mark, and as feet and inches', () => {
  expect(['12.5', ' 12,5 ', '-3', '−0.25', '.5'].map((typed) => parseLengthM(typed))).toEqual([
    12.5, 12.5, -3, -0.25, 0.5,
  ]);
  expect(parseLengthM(`5' 3 1/2"`)).toBeCloseTo(1.6129, 9);
  expect(parseLengthM(`-2'`)).toBeCloseTo(-0.6096, 9);
  for (const typed of ['', 'x', '1.2.3', '1,234.5', '1e3', '5 m', '--1']) expect(parseLengthM(typed), typed).toBeNull();
  units.value = 'ft';
  expect(parseLengthM('10')).toBeCloseTo(3.048, 9);
  // What is shown can be typed back.
  for (const m of [0.3048, 1.5, 4.2672]) expect(parseLengthM(feetAndInches(m))).toBeCloseTo(m, 2);
});
