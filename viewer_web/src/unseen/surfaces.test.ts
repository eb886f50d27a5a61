import { expect, test } from 'vitest';
import type { UnseenSurface } from '../load/plan-json.ts';
import { sumsByReason, surfacesShown } from './surfaces.ts';

const surface = (area_m2: number, reason: string, floor = 'F0'): UnseenSurface => ({
  element: 1,
  name: 'Wall',
  kind: 'IfcWall',
  room: null,
  floor,
  reason,
  area_m2,
  n_pieces: 1,
  pieces: [],
  best_spot: null,
});
const ALL = [
  surface(1, 'occluded'),
  surface(5, 'not worth a station', 'F1'),
  surface(3, 'occluded', 'F1'),
  surface(2, 'out of range'),
];

test('unseen surfaces are listed largest first, of a floor and of a reason', () => {
  const areas = (floorId: string | null, reason: string | null): number[] =>
    surfacesShown(ALL, { floorId, reason }).map(({ area_m2 }) => area_m2);
  expect(areas(null, null)).toEqual([5, 3, 2, 1]);
  expect(areas('F1', null)).toEqual([5, 3]);
  expect(areas('F0', 'occluded')).toEqual([1]);
  expect(ALL.map(({ area_m2 }) => area_m2)).toEqual([1, 5, 3, 2]);
});

test('areas add up by reason; what a station would mend comes first', () => {
  expect(sumsByReason(ALL)).toEqual([
    { reason: 'not worth a station', areaM2: 5, isMendable: true },
    { reason: 'occluded', areaM2: 4, isMendable: false },
    { reason: 'out of range', areaM2: 2, isMendable: false },
  ]);
});
