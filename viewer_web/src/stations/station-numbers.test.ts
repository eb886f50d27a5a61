import { expect, test } from 'vitest';
import { stationNumbers } from './station-numbers.ts';

test('a station has the number of its name, whatever its place in the list', () => {
  expect([...stationNumbers(['S004', 'S001', 'S12'])]).toEqual([
    ['S004', 4],
    ['S001', 1],
    ['S12', 12],
  ]);
});

test('stations of other names, or of one number, are counted', () => {
  for (const ids of [
    ['S004', 'hall'],
    ['S01', 'S001'],
    ['S1a', 'S2'],
  ]) {
    expect([...stationNumbers(ids).values()]).toEqual([1, 2]);
  }
});
