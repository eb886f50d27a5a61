import { type Signal, signal } from '@preact/signals';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { LiveState } from '../api/documents.ts';
import { ReviewClient } from '../api/review-client.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { PointerConsumer, PointerPlace } from '../scene/pointer.ts';
import { createStore, type Store } from '../store.ts';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { type DraftStation, draftStations } from './draft.ts';
import type { DraftFollower, DraftLayers } from './draft-follower.ts';
import { GROUND, GroundMap } from './ground-map.ts';
import { StationMover } from './station-mover.ts';

const READY: LiveState = { state: 'ready', step: null, fraction: null, message: null };
const OFFSET_M = [1000, 2000, 0] as const;
/** A metre of the floor is a pixel of the page. */
const at = (x: number, y: number, stationId: string | null = 'S001'): PointerPlace => ({
  clientX: x,
  clientY: y,
  stationId,
  event: {} as PointerEvent,
});

/** All of 20 m by 20 m around the origin of the local frame. */
function openGround(floorId: string): GroundMap {
  const head = { floor: floorId, origin: [990, 1990] as const, cell_m: 1, width: 20, height: 20 };
  return new GroundMap(head, new Uint8Array(400).fill(GROUND.admissible));
}

/** What the server says of any place: that a station can stand there, or at `where` in its stead. */
function previewOf(body: string, where: readonly number[] | null): Response {
  const { position, instrument_height_m, sequence } = JSON.parse(body) as Record<string, unknown>;
  const [, , z] = position as number[];
  const head = {
    admissible: true,
    reason: null,
    position: where === null ? position : [...where, z],
    instrument_height_m,
    sequence,
    n_patches_changed: 0,
  };
  const text = new TextEncoder().encode(JSON.stringify({ ...head, links: [] }));
  const bytes = new Uint8Array(4 + text.length);
  new DataView(bytes.buffer).setUint32(0, text.length, true);
  bytes.set(text, 4);
  return new Response(bytes);
}

let store: Store;
let server: FakeReviewServer;
let mover: StationMover;
let stations: Signal<DraftStation[]>;
let where: [number, number] | null;
let reviewClient: ReviewClient;
let pointer: PointerConsumer;
let answerGround: (ground: GroundMap) => void;
let refuseGround: (error: Error) => void;
beforeEach(async () => {
  vi.stubGlobal('requestAnimationFrame', () => 0);
  where = null;
  server = new FakeReviewServer();
  server.live = READY;
  reviewClient = new ReviewClient(
    new ApiClient(async (address, options) => {
      if (address === 'api/live/preview') return previewOf(String(options?.body), where);
      // Figures may come at any time, or never: nothing here is about them.
      if (address === 'api/live/figures') return new Promise(() => undefined);
      return server.fetch(address, options);
    }),
    { listen: () => () => undefined },
  );
  await reviewClient.open();
  store = createStore({ reviewClient });
  store.tab.value = 'edit';
  const plan = smallPlan();
  const view = {
    onPointer: (consumer: PointerConsumer) => {
      pointer = consumer;
      return () => undefined;
    },
    levelAt: (x: number, y: number, _: string, heightM: number) => [x, y, heightM],
    requestFrame: () => undefined,
    setDetail: () => undefined,
    showChange: () => undefined,
  } as unknown as PlanView;
  const loaded = { plan, stage: { offsetM: OFFSET_M } } as unknown as LoadedPlan;
  stations = signal(draftStations(plan, null));
  const follower = {
    stations,
    layers: signal<DraftLayers | null>(null),
  } as unknown as DraftFollower;
  const ground = new Promise<GroundMap>((resolve, reject) => {
    answerGround = resolve;
    refuseGround = reject;
  });
  mover = new StationMover(store, reviewClient, view, loaded, follower, () => ground);
});

afterEach(() => vi.unstubAllGlobals());

const movedTo = () => reviewClient.review.value?.stations.S001?.position_m?.slice(0, 2);

test('a station that is dragged before the ground is known follows the pointer once it is', async () => {
  expect(pointer.onDown?.(at(0, 0))).toBe(true);
  pointer.onMove?.(at(3, 4));
  expect(store.editing.underWay.value).toBeNull();
  answerGround(openGround('F0'));
  await expect.poll(() => store.editing.underWay.value?.positionM.slice(0, 2)).toEqual([1003, 2004]);
  pointer.onMove?.(at(5, 4));
  pointer.onUp?.(at(5, 4), false);
  await expect.poll(movedTo).toEqual([1005, 2004]);
  expect(store.editing.underWay.value).toBeNull();
});

test('a station that is let go before the ground is known stands where it was let go', async () => {
  pointer.onDown?.(at(0, 0));
  pointer.onMove?.(at(3, 4));
  pointer.onUp?.(at(3, 4), false);
  answerGround(openGround('F0'));
  await expect.poll(movedTo).toEqual([1003, 2004]);
});

test('a ground that does not come is told once, and the station stays where it is', async () => {
  const told: string[] = [];
  reviewClient.notice.subscribe((notice) => notice && told.push(notice.text));
  pointer.onDown?.(at(0, 0));
  pointer.onMove?.(at(3, 4));
  pointer.onUp?.(at(3, 4), false);
  refuseGround(new Error('no ground here'));
  await expect.poll(() => told).toEqual(['no ground here']);
  expect([movedTo(), store.editing.underWay.value]).toEqual([undefined, null]);
});

test('a station that is only clicked on stays where it is', async () => {
  pointer.onDown?.(at(0, 0));
  pointer.onUp?.(at(0, 0), true);
  answerGround(openGround('F0'));
  await reviewClient.commit('in turn', [{ kind: 'add_comment', text: 'a remark' }]);
  expect([movedTo(), store.editing.underWay.value]).toEqual([undefined, null]);
});

test('who changed the station while it was dragged is told of, and not overwritten', async () => {
  answerGround(openGround('F0'));
  pointer.onDown?.(at(0, 0));
  pointer.onMove?.(at(3, 4));
  await expect.poll(() => store.editing.underWay.value).not.toBeNull();
  server.changeAs('Ben', { kind: 'move_station', station: 'S001', position_m: [1001, 2000, 1.7] });
  // This page hears of it while the drag goes on.
  await reviewClient.open();
  expect(reviewClient.review.value?.revision).toBe(1);
  pointer.onUp?.(at(3, 4), false);
  await expect.poll(() => reviewClient.conflict.value?.words).toMatch(/^Ben changed station S001/);
  expect(movedTo()).toEqual([1001, 2000]);
  await reviewClient.applyMine();
  await expect.poll(movedTo).toEqual([1003, 2004]);
});

test('where others only raised the station meanwhile, its place and their height are both kept', async () => {
  answerGround(openGround('F0'));
  const [before] = stations.value;
  pointer.onDown?.(at(0, 0));
  pointer.onMove?.(at(3, 4));
  await expect.poll(() => store.editing.underWay.value).not.toBeNull();
  const [x, y, z] = before.positionM;
  const heightM = (before.instrumentHeightM ?? 0) + 0.2;
  server.changeAs('Ben', { kind: 'move_station', station: 'S001', position_m: [x, y, z + 0.2] });
  pointer.onUp?.(at(3, 4), false);
  await expect.poll(() => reviewClient.conflict.value).not.toBeNull();
  stations.value = stations.value.map((one) =>
    one.id === 'S001' ? { ...one, positionM: [x, y, z + 0.2], instrumentHeightM: heightM } : one,
  );
  expect(reviewClient.conflict.value?.together()).toEqual([
    {
      kind: 'move_station',
      station: 'S001',
      position_m: [1003, 2004, expect.closeTo(z + 0.2)],
      instrument_height_m: expect.closeTo(heightM),
      floor: before.floorId,
    },
  ]);
  await reviewClient.applyMine();
  await expect.poll(movedTo).toEqual([1003, 2004]);
  expect(reviewClient.review.value?.stations.S001.position_m?.[2]).toBeCloseTo(z + 0.2);
});

test.each([
  ['isLocked', 'Station S001 is locked. Unlock it to move it.'],
  ['isFixed', 'Station S001 is already scanned: its position can’t be changed.'],
] as const)('a station that %s is not dragged, and the reason is told once it is tried', async (what, words) => {
  stations.value = stations.value.map((station) => ({ ...station, [what]: true }));
  answerGround(openGround('F0'));
  // The press is taken: the building must not turn under the finger.
  expect(pointer.onDown?.(at(0, 0))).toBe(true);
  expect(reviewClient.notice.value).toBeNull();
  pointer.onMove?.(at(3, 4));
  expect(reviewClient.notice.value?.text).toBe(words);
  pointer.onUp?.(at(3, 4), false);
  await reviewClient.commit('in turn', [{ kind: 'add_comment', text: 'a remark' }]);
  expect([movedTo(), store.editing.underWay.value]).toEqual([undefined, null]);
  await mover.nudge(stations.value[0], 0.1, 0);
  expect(reviewClient.notice.value?.text).toBe(words);
});

test('a lock that is on its way when the station is dragged holds', async () => {
  answerGround(openGround('F0'));
  void reviewClient
    .commit('lock S001', [{ kind: 'add_comment', text: 'stands for a lock, answered late' }])
    .then(() => {
      stations.value = stations.value.map((station) => ({ ...station, isLocked: true }));
    });
  pointer.onDown?.(at(0, 0));
  pointer.onMove?.(at(3, 4));
  pointer.onUp?.(at(3, 4), false);
  await expect.poll(() => reviewClient.notice.value?.text).toBe('Station S001 is locked. Unlock it to move it.');
  expect([movedTo(), store.editing.underWay.value]).toEqual([undefined, null]);
});

test('a drag that began before a change of one’s own was answered is no conflict with it', async () => {
  answerGround(openGround('F0'));
  void reviewClient.commit('move S001', [{ kind: 'move_station', station: 'S001', position_m: [1001, 2001, 1.3] }]);
  pointer.onDown?.(at(0, 0));
  pointer.onMove?.(at(3, 4));
  pointer.onUp?.(at(3, 4), false);
  await expect.poll(movedTo).toEqual([1003, 2004]);
  expect(reviewClient.conflict.value).toBeNull();
});

test('steps by keys add up, stop where no tripod can stand, and are one change', async () => {
  answerGround(openGround('F0'));
  const station = stations.value[0];
  await Promise.all([mover.nudge(station, 0.1, 0), mover.nudge(station, 0.1, 0), mover.nudge(station, 0, -0.1)]);
  expect(store.editing.underWay.value?.positionM).toEqual([expect.closeTo(1001.2), expect.closeTo(1999.9), 1.3]);
  await mover.nudge(station, 100, 0);
  expect(reviewClient.notice.value?.text).toBe('No tripod can stand further that way.');
  await mover.finish();
  expect(movedTo()).toEqual([expect.closeTo(1001.2), expect.closeTo(1999.9)]);
  expect(reviewClient.review.value?.revision).toBe(1);
});

test('a station added beside the click says so, and has the middle height of its floor', async () => {
  const heights = [0.5, 1.6, 1.7];
  stations.value = stations.value.map((one, i) => ({ ...one, floorId: 'F0', instrumentHeightM: heights[i] }));
  answerGround(openGround('F0'));
  where = [1003.9, 2004];
  await mover.add('F0', [1003, 2004], 0);
  const [[id, added]] = Object.entries(reviewClient.review.value?.stations ?? {});
  expect([added.position_m, added.instrument_height_m]).toEqual([[1003.9, 2004, 1.6], 1.6]);
  expect(reviewClient.notice.value?.text).toBe(`No tripod can stand at that point: ${id} was added 0.90 m away.`);
  where = null;
  await mover.add('F0', [1005, 2004], 0);
  expect(reviewClient.notice.value).toBeNull();
});
