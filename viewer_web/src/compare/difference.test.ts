import { expect, test } from 'vitest';
import { NOT_ACHIEVABLE, NOT_ASKED } from '../heat/layers.ts';
import { DIFFERENCE, differenceLayer, differenceOf, stationChanges } from './difference.ts';

test('a patch is gained, lost, seen in both, in neither, or not achievable', () => {
  const shown = Uint8Array.of(2, 0, 1, 0, NOT_ACHIEVABLE, NOT_ACHIEVABLE, 3);
  const other = Uint8Array.of(0, 1, 4, 0, NOT_ACHIEVABLE, 2, NOT_ACHIEVABLE);
  const { none, both, lost, gained } = DIFFERENCE;
  expect([...differenceOf(shown, other)]).toEqual([gained, lost, both, none, NOT_ACHIEVABLE, lost, gained]);
});

test('what either plan was not asked for is not compared', () => {
  const shown = Uint8Array.of(NOT_ASKED, 0, NOT_ASKED, 2);
  const other = Uint8Array.of(3, NOT_ASKED, NOT_ASKED, 2);
  expect([...differenceOf(shown, other)]).toEqual([NOT_ASKED, NOT_ASKED, NOT_ASKED, DIFFERENCE.both]);
  const labels = (isOfSomeFloors: boolean) =>
    differenceLayer('Run R001', false, isOfSomeFloors).classes.map(({ label }) => label);
  expect(labels(true)).toContain('not to be covered, or in one plan only');
  expect(labels(false)).not.toContain('not to be covered, or in one plan only');
});

test('plans of different surfaces are not compared', () => {
  expect(() => differenceOf(new Uint8Array(3), new Uint8Array(4))).toThrow(/3 patches against 4/);
});

const at = (x: number, y = 0, floorId = 'F0') => ({ positionM: [x, y, 1.3] as const, floorId });

test('the nearest stations of a floor are the same one moved', () => {
  const changes = stationChanges([at(0), at(1.5), at(10)], [at(1), at(0.005)]);
  expect(changes).toEqual([
    { kind: 'moved', fromM: [1, 0, 1.3], toM: [1.5, 0, 1.3], floorId: 'F0' },
    { kind: 'new', atM: [10, 0, 1.3], floorId: 'F0' },
  ]);
});

test('stations of different floors are never the same one', () => {
  expect(stationChanges([at(0, 0, 'F1')], [at(0, 0, 'F0')]).map(({ kind }) => kind)).toEqual(['new', 'gone']);
});

test('every station of either plan is told of at most once', () => {
  const [shown, other] = [
    [at(0), at(0.1), at(0.2)],
    [at(0.05), at(0.15)],
  ];
  const changes = stationChanges(shown, other);
  expect(changes.filter(({ kind }) => kind === 'moved')).toHaveLength(2);
  expect(changes.filter(({ kind }) => kind === 'new')).toHaveLength(1);
});
