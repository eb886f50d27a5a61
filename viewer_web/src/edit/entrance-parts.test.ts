import { expect, test } from 'vitest';
import type { Review } from '../api/documents.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { EMPTY_REVIEW } from '../testing/fake-review-server.ts';
import { entranceEntries } from './entrance-parts.tsx';
import { reviewAreas } from './review-areas.ts';

const cornersM = Float32Array.from([1, 2, 0, 1.9, 2, 0, 1.9, 2.05, 2]);
const door = { sceneIndex: 4, name: 'Door 7', kind: 'IfcDoor', sourceId: '0w$5B', floorId: 'F0', file: 0 };
const LOADED = {
  stage: {
    elements: [{ ...door, firstTriangle: 0, nTriangles: 1 }],
    triangles: { cornersM },
    floors: [
      { id: 'F0', elevationM: 0 },
      { id: 'F1', elevationM: 3 },
    ],
    offsetM: [1000, 2000, 0],
  },
} as unknown as LoadedPlan;
const entrance = (id: string, floor: string) => ({ id, position_m: [1005, 2006, 3] as const, floor });
const REVIEW: Review = {
  ...EMPTY_REVIEW,
  entrances: { E1000: entrance('E1000', 'F0'), E002: entrance('E002', 'F1') },
  doors: { '0w$5B': 'shut', gone: 'open' },
};

test('entrances and doors stand in the list, each with what takes it back', () => {
  const entries = entranceEntries(REVIEW, LOADED, (floor) => floor || 'all floors');
  expect(entries.map(({ title, detail, back }) => [title, detail, back])).toEqual([
    ['Entrance', 'the route begins here, F1', { kind: 'remove_entrance', id: 'E002' }],
    ['Entrance', 'F0', { kind: 'remove_entrance', id: 'E1000' }],
    ['Door 7: shut', 'in the next plan, F0', { kind: 'set_door', door: '0w$5B', state: null }],
    ['Door: open', 'in the next plan, all floors', { kind: 'set_door', door: 'gone', state: null }],
  ]);
});

test('an entrance is marked at its height, and a door with a circle round it', () => {
  const areas = reviewAreas(REVIEW, LOADED, false);
  expect(areas.map(({ kind, floorId, heightM }) => [kind, floorId, heightM])).toEqual([
    ['entrance', 'F0', 3],
    ['entrance', 'F1', 3],
    ['door_shut', 'F0', 0],
  ]);
  const middle = (k: 0 | 1, outline = areas[0].outline!) =>
    outline.reduce((sum, at) => sum + at[k], 0) / outline.length;
  expect([middle(0), middle(1)]).toEqual([expect.closeTo(5), expect.closeTo(6)]);
  const round = areas[2].outline!;
  expect(Math.hypot(round[0][0] - 1.45, round[0][1] - 2.025)).toBeCloseTo(Math.hypot(0.45, 0.025), 5);
});
