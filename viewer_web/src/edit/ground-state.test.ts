import { expect, test } from 'vitest';
import type { Review } from '../api/documents.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { EMPTY_REVIEW } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import type { DraftStation } from './draft.ts';
import { groundOfRegion, nothingToPick, standingOn } from './ground-state.ts';

/** A square of two triangles from (x, 0) at a height. */
const square = (x: number, z: number): number[] => [x, 0, z, x + 2, 0, z, x + 2, 2, z, x, 0, z, x + 2, 2, z, x, 2, z];
/** The ground of F0 (0, 1), a table (2, 3), the ground of F1 (4, 5). */
const LOADED = {
  plan: smallPlan(),
  stage: {
    triangles: {
      cornersM: Float32Array.from([...square(0, 0), ...square(5, 0.7), ...square(0, 3)]),
      groundOf: Uint8Array.of(1, 1, 0, 0, 2, 2),
    },
    floors: [
      { id: 'F0', index: 0 },
      { id: 'F1', index: 1 },
    ],
    offsetM: [100, 0, 0],
  },
} as unknown as LoadedPlan;
const [GROUND, TABLE, UPPER] = [
  [0, 1],
  [2, 3],
  [4, 5],
];
type Pick = Review['ground_picks'][string];
const pick = (x: number, z: number, is_ground: boolean, floor = ''): Pick => ({
  point_m: [100 + x, 0.5, z],
  is_ground,
  floor,
});
const reviewOf = (...picks: Pick[]): Review => ({
  ...EMPTY_REVIEW,
  ground_picks: Object.fromEntries(picks.map((each, i) => [`G${i}`, each])),
});

test('picks have their say one after the other, over the ground of the plan', () => {
  const of = (region: readonly number[], ...picks: Pick[]) => groundOfRegion(region, LOADED, reviewOf(...picks));
  expect([of(GROUND), of(TABLE), of(UPPER)]).toEqual([
    ['F0', 'F0'],
    [null, null],
    ['F1', 'F1'],
  ]);
  expect(of(GROUND, pick(1, 0, false))).toEqual([null, null]);
  expect(of(GROUND, pick(1, 0, false, 'F1'))).toEqual(['F0', 'F0']);
  expect(of(GROUND, pick(1, 0, false), pick(1, 0, true, 'F1'))).toEqual(['F1', 'F1']);
  expect(of(GROUND, pick(1, 0, true))).toEqual(['F0', 'F0']);
  expect(of(TABLE, pick(6, 0.7, true))).toEqual(['', '']);
  expect(of(TABLE, pick(6, 0.7, true), pick(6, 0.7, false, 'F0'))).toEqual([null, null]);
});

test('marking ground and unmarking none is refused in words, and everything else is not', () => {
  const words = (region: readonly number[], isGround: boolean, floorId: string, ...picks: Pick[]) =>
    nothingToPick(region, LOADED, reviewOf(...picks), isGround, floorId);
  expect(words(GROUND, true, '')).toBe('Already a walkable floor of Ground floor: nothing to mark.');
  expect(words(GROUND, true, 'F0')).toBe('Already a walkable floor of Ground floor: nothing to mark.');
  expect(words(GROUND, true, 'F1')).toBeNull();
  expect(words(GROUND, false, '')).toBeNull();
  expect(words(GROUND, false, 'F1')).toMatch(/Not a walkable floor of Upper floor/);
  expect(words(TABLE, true, 'F0')).toBeNull();
  expect(words(TABLE, false, '')).toMatch(/nothing to unmark/);
  expect(words(TABLE, true, '', pick(6, 0.7, true))).toBe('Already a walkable floor: nothing to mark.');
  expect(words([...GROUND, ...TABLE], true, '')).toBeNull();
  // An underside of a wall, a tenth of the ground: what is marked already is the rest.
  const { triangles } = LOADED.stage;
  const wall = [0, 0, 0, 0.4, 0, 0, 0.4, 2, 0];
  const cornersM = Float32Array.from([...triangles.cornersM.subarray(0, 18), ...wall]);
  const flush = { ...triangles, cornersM, groundOf: Uint8Array.of(1, 1, 0) };
  const loaded = { ...LOADED, stage: { ...LOADED.stage, triangles: flush } };
  expect(nothingToPick([0, 1, 2], loaded, null, true, '')).toMatch(/Already a walkable floor of Ground floor/);
  expect(nothingToPick(TABLE, LOADED, null, false, '')).toMatch(/nothing to unmark/);
});

test('stations stand on a surface where their foot is on it or on a layer of the same floor', () => {
  const station = (id: string, x: number, z: number, more: Partial<DraftStation> = {}): DraftStation =>
    ({ id, floorId: 'F0', positionM: [100 + x, 1, z], instrumentHeightM: 1.5, ...more }) as DraftStation;
  const stations = [
    station('on it', 1, 1.5),
    station('on a covering', 1.9, 1.8),
    station('beside it', 3, 1.5),
    station('above', 1, 4.5, { floorId: 'F1' }),
    station('removed', 1, 1.5, { isRemoved: true }),
    station('scanned', 1, 1.5, { isFixed: true }),
    station('of unknown height', 0.5, 1.9, { instrumentHeightM: null }),
  ];
  expect(standingOn(GROUND, LOADED, stations, '')).toEqual(['on it', 'on a covering', 'of unknown height']);
  expect(standingOn(GROUND, LOADED, stations, 'F1')).toEqual([]);
  expect(standingOn(UPPER, LOADED, stations, 'F1')).toEqual(['above']);
});
