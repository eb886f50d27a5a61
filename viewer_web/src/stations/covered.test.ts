import { expect, test } from 'vitest';
import type { MarkerPlace } from '../scene/marker-place.ts';
import { coveredAmong, isSameCovered, NONE_COVERED } from './covered.ts';
import type { ShownStation } from './shown.ts';

const SPREAD = { width: 100, height: 80, isWhole: false };

const shown = (id: string, floorId: string): ShownStation => ({
  id,
  floorId,
  number: 1,
  order: 1,
  positionM: [0, 0, 0],
  marks: [],
});
const at = (coveredBy: string | null, isHidden = coveredBy !== null, x = 50): MarkerPlace => ({
  x,
  y: 40,
  isHidden,
  coveredBy,
});

const STATIONS = [shown('S001', 'F0'), shown('S002', 'F0'), shown('S003', 'F1'), shown('S004', 'F2')];

test('stations behind other floors are counted by the floor they stand on, the chosen one apart', () => {
  const places = new Map([
    ['S001', at('F1')],
    ['S002', at('F2')],
    ['S003', at('F2')],
    ['S004', at(null)],
  ]);
  const none = coveredAmong(places, STATIONS, [], SPREAD);
  expect(none.chosen).toEqual([]);
  expect([...none.nByFloor]).toEqual([
    ['F0', 2],
    ['F1', 1],
  ]);
  const one = coveredAmong(places, STATIONS, ['S002'], SPREAD);
  expect(one.chosen).toEqual([{ id: 'S002', by: 'F2' }]);
  expect([...one.nByFloor]).toEqual([
    ['F0', 1],
    ['F1', 1],
  ]);
});

test('of a chosen pair each is named that another floor hides', () => {
  const places = new Map([
    ['S001', at('F1')],
    ['S002', at('F1')],
    ['S003', at(null)],
  ]);
  const pair = coveredAmong(places, STATIONS, ['S002', 'S003'], SPREAD);
  expect(pair).toEqual({ chosen: [{ id: 'S002', by: 'F1' }], nByFloor: new Map([['F0', 1]]) });
});

test('what lies beside the picture, or behind the camera, is not hidden by a floor', () => {
  const places = new Map([
    ['S001', at('F1', true, -1)],
    ['S002', at('F1', true, 101)],
  ]);
  expect(coveredAmong(places, STATIONS, ['S003'], SPREAD)).toEqual(NONE_COVERED);
});

test('walls of its own floor hide no chosen station that is worth a word, those of a closed building do', () => {
  const places = new Map([
    ['S001', at(null, true)],
    ['S003', at(null, true)],
  ]);
  expect(coveredAmong(places, STATIONS, ['S001'], SPREAD)).toEqual(NONE_COVERED);
  const whole = coveredAmong(places, STATIONS, ['S001'], { ...SPREAD, isWhole: true });
  expect(whole).toEqual({ chosen: [{ id: 'S001', by: null }], nByFloor: new Map() });
  expect(coveredAmong(new Map([['S001', at(null)]]), STATIONS, ['S001'], { ...SPREAD, isWhole: true }).chosen).toEqual(
    [],
  );
});

test('what is covered is told anew only where it differs', () => {
  const of = (by: string | null, n: number) => ({ chosen: [{ id: 'S001', by }], nByFloor: new Map([['F0', n]]) });
  expect(isSameCovered(of('F1', 2), of('F1', 2))).toBe(true);
  for (const other of [of('F2', 2), of('F1', 3), NONE_COVERED, { ...of('F1', 2), nByFloor: new Map([['F1', 2]]) }]) {
    expect(isSameCovered(of('F1', 2), other)).toBe(false);
  }
});
