import { signal } from '@preact/signals';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import type { ReviewClient } from '../api/review-client.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { createStore, type Store } from '../store.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { CloudDetailFollower } from './cloud-detail.ts';

const HEAD = {
  rows: 2,
  columns: 3,
  range_step_m: 0.001,
  elevations_rad: [0.1, 0],
  azimuths_rad: [0, 0],
  azimuth_step_rad: 0.1,
  beams: 24,
};
let asked: string[];
let pose: string;
let places: [number, number, number][];
let follower: CloudDetailFollower;
let store: Store;

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal('window', { devicePixelRatio: 1, setTimeout, clearTimeout });
  asked = [];
  pose = 'far';
  places = [];
  const client = {
    framed: async (path: string) => {
      asked.push(path);
      return { head: HEAD, body: new Uint8Array(18).fill(1).buffer };
    },
  };
  const live = signal({ state: 'ready', step: null, fraction: null, message: null });
  store = createStore({ reviewClient: { client, live, warn: vi.fn() } as unknown as ReviewClient });
  const plan = smallPlan();
  const stations = plan.stations.map(({ id, floor, order }) => ({
    id,
    floorId: floor,
    order,
    positionM: [0, 0, 1],
    elevationsRad: Float32Array.of(0.5, 0.1, 0, -0.5),
  }));
  const floors = plan.floors.map(({ id, name }, index) => ({
    id,
    name,
    index,
    elevationM: 3 * index,
    topM: 3 * index + 3,
  }));
  const loaded = { base: '', plan, stage: { floors, stations, offsetM: [0, 0, 0] } } as unknown as LoadedPlan;
  store.loaded.value = loaded;
  const whole = { minM: [0, 0, 0] as const, maxM: [10, 8, 6] as const };
  store.extents.value = { whole, grounds: new Map() } as never;
  const sight = { pose: () => pose, places: () => places, target: () => [0, 0, 0] as const };
  follower = new CloudDetailFollower(store, loaded, sight, () => undefined);
});
afterEach(() => {
  follower.dispose();
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const shows = (nBeams: number): void => {
  store.chooseStation('S001');
  store.cloud.value = { kind: 'shown', nReturns: nBeams, nStations: 1, nBeams, nScanned: 720 };
};
const lookAt = async (now: string, ...there: [number, number, number][]): Promise<void> => {
  [pose, places] = [now, there];
  follower.onFrame();
  await vi.advanceTimersByTimeAsync(1000);
};

test('closer by, all beams of what is looked at are asked for once the camera stands still', async () => {
  shows(24);
  await lookAt('close', [2, 0, 1.1], [2, 0.5, 1.1], [2, 0.2, 1.3]);
  expect(asked).toHaveLength(1);
  expect(asked[0]).toMatch(
    /^live\/stations\/S001\/cloud-window\?azimuth=-0\.02\d+&width=0\.2\d+&low=0\.0\d+&high=0\.1\d+$/,
  );
  expect(store.cloudDetail.value).toEqual({ stationId: 'S001', nBeams: 6, nScanned: 24 });
  expect(follower.group.children).toHaveLength(1);
  // Without a movement nothing is asked again.
  await lookAt('close', [2, 0, 1.1], [2, 0.5, 1.1], [2, 0.2, 1.3]);
  expect(asked).toHaveLength(1);
});

test('from afar, or where all beams are drawn, nothing is asked for; what was there goes', async () => {
  shows(720);
  await lookAt('close', [2, 0, 1.1], [2, 0.5, 1.1]);
  expect(asked).toEqual([]);
  shows(24);
  await lookAt('closer', [2, 0, 1.1], [2, 0.5, 1.1], [2, 0.2, 1.3]);
  expect(store.cloudDetail.value).not.toBeNull();
  await lookAt('far', [2, 0, 0], [-2, 0, 0], [0, 2, 3], [0, -2, 0], [1, 1, 2]);
  expect([asked.length, store.cloudDetail.value, follower.group.children.length]).toEqual([1, null, 0]);
});

test('of another station the detail goes with the choice', async () => {
  shows(24);
  await lookAt('close', [2, 0, 1.1], [2, 0.5, 1.1], [2, 0.2, 1.3]);
  store.chooseStation(null);
  expect([store.cloudDetail.value, follower.group.children.length]).toEqual([null, 0]);
});
