import { signal } from '@preact/signals';
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
import { draftStations } from './draft.ts';
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

/** What the server says of any place: that a station can stand there. */
function previewOf(body: string): Response {
  const { position, instrument_height_m, sequence } = JSON.parse(body) as Record<string, unknown>;
  const head = { admissible: true, reason: null, position, instrument_height_m, sequence, n_patches_changed: 0 };
  const text = new TextEncoder().encode(JSON.stringify({ ...head, links: [] }));
  const bytes = new Uint8Array(4 + text.length);
  new DataView(bytes.buffer).setUint32(0, text.length, true);
  bytes.set(text, 4);
  return new Response(bytes);
}

let store: Store;
let reviewClient: ReviewClient;
let pointer: PointerConsumer;
let answerGround: (ground: GroundMap) => void;
let refuseGround: (error: Error) => void;
beforeEach(async () => {
  vi.stubGlobal('requestAnimationFrame', () => 0);
  const server = new FakeReviewServer();
  server.live = READY;
  reviewClient = new ReviewClient(
    new ApiClient(async (address, options) => {
      if (address === 'api/live/preview') return previewOf(String(options?.body));
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
  } as unknown as PlanView;
  const loaded = { plan, stage: { offsetM: OFFSET_M } } as unknown as LoadedPlan;
  const follower = {
    stations: signal(draftStations(plan, null)),
    layers: signal<DraftLayers | null>(null),
  } as unknown as DraftFollower;
  const ground = new Promise<GroundMap>((resolve, reject) => {
    answerGround = resolve;
    refuseGround = reject;
  });
  new StationMover(store, reviewClient, view, loaded, follower, () => ground);
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
