import { expect, test } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { Change } from '../api/documents.ts';
import { ReviewClient } from '../api/review-client.ts';
import { LEFT_BY_EDITS } from '../heat/layers.ts';
import type { UnseenSurface } from '../load/plan-json.ts';
import { createStore } from '../store.ts';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { sumsByReason, surfacesShown, unseenShown } from './surfaces.ts';

const surface = (area_m2: number, reason: string, floor = 'F0'): UnseenSurface => ({
  element: 1,
  name: 'Wall',
  kind: 'IfcWall',
  source_id: '1xS3BCk291UvhgP2dvNsgp',
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

async function editedStore() {
  const reviewClient = new ReviewClient(new ApiClient(new FakeReviewServer().fetch), { listen: () => () => undefined });
  await reviewClient.open();
  const store = createStore({ reviewClient });
  const why = { stations: [], curve: [], unseen_surfaces: ALL };
  store.loaded.value = { plan: { ...smallPlan(), why } } as never;
  return { reviewClient, store };
}
const MOVE: Change = { kind: 'move_station', station: 'S001', position_m: [1005, 2000, 1.3] };

test('the list is the plan’s while nothing is edited, and where an older version made the plan there is none', async () => {
  const { store } = await editedStore();
  expect(unseenShown(store)).toEqual({ of: 'plan', isStale: false, surfaces: ALL });
  store.loaded.value = { plan: smallPlan() } as never;
  expect(unseenShown(store)).toBeNull();
});

test('the list follows the edited plan: what stations change is the draft’s, what none can see stays the plan’s', async () => {
  const { reviewClient, store } = await editedStore();
  await reviewClient.commit('move', [MOVE]);
  expect(unseenShown(store)).toEqual({ of: 'not edited', isStale: false, surfaces: ALL });
  reviewClient.live.value = { state: 'ready', step: null, fraction: null, message: null };
  const { reason: _, best_spot: __, ...left } = surface(7, '');
  const { stations, coverage, registration } = smallPlan();
  const figures = { coverage, floors: coverage.floors, requirements: [], stations, registration, unseen: [left] };
  reviewClient.figures.value = { ...figures, revision: 1, curve: [], curve_stations: [] };
  const shown = unseenShown(store);
  expect(shown?.of).toBe('edited');
  expect(sumsByReason(shown!.surfaces)).toEqual([
    { reason: LEFT_BY_EDITS, areaM2: 7, isMendable: true },
    { reason: 'occluded', areaM2: 4, isMendable: false },
    { reason: 'out of range', areaM2: 2, isMendable: false },
  ]);
  reviewClient.figures.value = { ...reviewClient.figures.value!, revision: 0 };
  expect(unseenShown(store)?.isStale).toBe(true);
  store.editing.showsPlan.value = true;
  expect(unseenShown(store)?.of).toBe('plan');
});
