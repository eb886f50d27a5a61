import { afterEach, beforeEach, expect, test } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { Change, LiveState, Run } from '../api/documents.ts';
import { ReviewClient } from '../api/review-client.ts';
import { TIMES_SEEN } from '../heat/layers.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { createStore, type Store } from '../store.ts';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { DraftFollower, watchableRun } from './draft-follower.ts';

const READY: LiveState = { state: 'ready', step: null, fraction: null, message: null };
const move = (x: number): Change => ({ kind: 'move_station', station: 'S001', position_m: [x, 2000, 1.3] });

const ROUTE = { revision: 1, route: { order: ['S001'], length_m: 21 }, field_time: { walking_s: 15 } };

let asked: string[];
let reviewClient: ReviewClient;
let store: Store;
let follower: DraftFollower;
beforeEach(async () => {
  const server = new FakeReviewServer();
  asked = [];
  reviewClient = new ReviewClient(
    new ApiClient(async (address, options) => {
      if (!address.startsWith('api/live/')) return server.fetch(address, options);
      asked.push(address.slice('api/live/'.length));
      if (address.endsWith('route')) return new Response(JSON.stringify(ROUTE));
      if (address.endsWith('figures')) return new Response('no figures here', { status: 404 });
      return new Response(Uint8Array.of(1, 2, 3, 4));
    }),
    { listen: () => () => undefined },
  );
  await reviewClient.open();
  store = createStore({ reviewClient });
  const plan = smallPlan();
  const floors = plan.floors.map(({ id, elevation_m }) => ({ id, elevationM: elevation_m, topM: elevation_m + 2.8 }));
  const loaded = { plan, stage: { floors, offsetM: [1000, 2000, 0], stations: [] } } as unknown as LoadedPlan;
  store.loaded.value = loaded;
  follower = new DraftFollower(store, reviewClient, loaded);
});
afterEach(() => follower.dispose());

const placeOf = (id: string) => store.draft.value?.stations.find((station) => station.id === id)?.positionM;

test('a plan without edits is shown as it is', () => {
  expect([store.draft.value, store.layerSource.value, store.stationSource.value]).toEqual([null, null, null]);
});

test('an edited plan is shown as edited, and as planned where that is wished', async () => {
  await reviewClient.commit('move', [move(1005)]);
  expect(placeOf('S001')).toEqual([5, 0, 1.3]);
  expect(store.draft.value?.links.map(({ a, b }) => `${a} ${b}`)).toEqual(['S001 S002', 'S002 S003']);
  store.editing.showsPlan.value = true;
  expect(store.draft.value).toBeNull();
});

test('a station on its way stands where it is dragged, with the links it would have', async () => {
  const positionM = [1002, 2001, 1.4] as const;
  store.editing.underWay.value = { stationId: 'S002', floorId: 'F0', positionM, heightM: 1.4 };
  expect(placeOf('S002')).toEqual([2, 1, 1.4]);
  expect(store.draft.value?.links).toHaveLength(2);
  const link = { a: 'S002', b: 'S003', overlap: 0.5, strength: 0.2, weak_motion: null };
  store.editing.preview.value = { links: [link] } as unknown as typeof store.editing.preview.value;
  expect(store.draft.value?.links).toEqual([link]);
});

test('a station that the review no longer has is let go of, whoever removed it', async () => {
  await reviewClient.commit('move', [move(1005)]);
  store.chooseStation('S001');
  store.selection.value = new Set(['S001', 'S002']);
  await reviewClient.commit('move', [move(1006)]);
  expect(store.stationId.value).toBe('S001');
  const { S001 } = reviewClient.review.value!.stations;
  const removed = { ...reviewClient.review.value!, stations: { S001: { ...S001, removed: true } } };
  reviewClient.review.value = removed;
  expect(store.stationId.value).toBeNull();
  expect([...store.selection.value]).toEqual(['S002']);
  store.chooseStation('S001');
  expect(store.stationId.value).toBeNull();
  store.editing.showsPlan.value = true;
  store.chooseStation('S001');
  expect(store.stationId.value).toBe('S001');
  store.editing.showsPlan.value = false;
  expect(store.stationId.value).toBeNull();
});

test('a pair goes with one of its stations', async () => {
  await reviewClient.commit('move', [move(1005)]);
  store.choosePair(['S001', 'S002']);
  const { S001 } = reviewClient.review.value!.stations;
  reviewClient.review.value = { ...reviewClient.review.value!, stations: { S002: { ...S001, removed: true } } };
  expect(store.pair.value).toBeNull();
});

test('values come from the live side where it is ready, anew for every state of the draft', async () => {
  await reviewClient.commit('move', [move(1005)]);
  expect(store.layerSource.value).toBeNull();
  reviewClient.live.value = READY;
  const first = store.layerSource.value;
  expect([...(await first!(TIMES_SEEN))!]).toEqual([1, 2, 3, 4]);
  expect([...(await first!('range'))!]).toEqual([0x0201, 0x0403]);
  expect([...follower.layers.value!.valuesOf('range')!]).toEqual([0x0201, 0x0403]);
  expect(await first!('reason')).toBeNull();
  await reviewClient.commit('comment', [{ kind: 'add_comment', text: 'a remark changes no values' }]);
  expect(store.layerSource.value).toBe(first);
  await reviewClient.commit('move', [move(1006)]);
  expect(store.layerSource.value).not.toBe(first);
});

test('only stations that are not where the plan has them are asked of the live side', async () => {
  reviewClient.live.value = READY;
  await reviewClient.commit('move', [move(1005)]);
  asked.length = 0;
  expect(await store.stationSource.value!.seen('S002')).toBeNull();
  expect([...(await store.stationSource.value!.seen('S001'))!]).toEqual([1, 2, 3, 4]);
  expect(asked).toEqual(['stations/S001/seen']);
});

test('the route of an edited plan is fetched where its length is shown or it is drawn, and is the same in both', async () => {
  store.tab.value = 'edit';
  reviewClient.live.value = READY;
  await reviewClient.commit('move', [move(1005)]);
  expect(asked).not.toContain('route');
  store.tab.value = 'plan';
  await expect.poll(() => store.shownRoute.value?.length_m).toBe(21);
  expect(store.shownTime.value?.walking_s).toBe(15);
  const shown = store.shownRoute.value;
  store.showRoute.value = true;
  expect(store.shownRoute.value).toBe(shown);
  store.tab.value = 'edit';
  expect(store.shownRoute.value).toBe(shown);
  store.showRoute.value = false;
  expect(store.draftRoute.value).toBeNull();
  store.tab.value = 'plan';
  store.editing.showsPlan.value = true;
  expect(store.draftRoute.value).toBeNull();
});

test('the route of a plan that is entered elsewhere is another one, with no station edited', async () => {
  reviewClient.live.value = READY;
  store.showRoute.value = true;
  expect(asked).not.toContain('route');
  const entrance = { id: 'E001', position_m: [1000, 2000, 0] as const, floor: 'F0' };
  reviewClient.review.value = { ...reviewClient.review.value!, entrances: { E001: entrance } };
  await expect.poll(() => store.shownRoute.value?.order).toEqual(['S001']);
  reviewClient.review.value = { ...reviewClient.review.value!, entrances: {} };
  expect(store.draftRoute.value).toBeNull();
});

test('while a run goes on, those who look at runs see its best stations', () => {
  const stations = [
    [1001, 2001, 1.3],
    [1002, 2002, 4.1],
  ];
  reviewClient.runs.value = [{ id: 'R001', state: 'running', best: { n_stations: 2, stations } } as unknown as Run];
  expect(store.draft.value).toBeNull();
  store.tab.value = 'runs';
  expect(store.draft.value?.stations.map(({ floorId, positionM }) => [floorId, positionM])).toEqual([
    ['F0', [1, 1, 1.3]],
    ['F1', [2, 2, 4.1]],
  ]);
  expect(watchableRun(store)?.id).toBe('R001');
  store.editing.watchesRun.value = false;
  expect(store.draft.value).toBeNull();
  expect(watchableRun(store)?.id).toBe('R001');
  reviewClient.runs.value = [{ id: 'R001', state: 'finished', best: { n_stations: 2, stations } } as unknown as Run];
  expect(watchableRun(store)).toBeNull();
});
