import type { Vector3 } from 'three';
import { beforeEach, expect, test } from 'vitest';
import type { Extent } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { createStore, type Store } from '../store.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { Flights } from './flights.ts';
import type { SurfacePicker } from './pick.ts';
import type { Viewport } from './viewport.ts';

/** What was asked of the camera, newest last. */
let asked: string[];
let store: Store;
let flights: Flights;
let viewport: Pick<Viewport, 'box' | 'showAll' | 'approach' | 'flyTo' | 'place' | 'onFlight' | 'onMovedByHand'>;

beforeEach(() => {
  asked = [];
  viewport = {
    onMovedByHand: () => undefined,
    onFlight: () => undefined,
    box: () => ({ x: 340, width: 940, right: 1280, height: 800 }) as DOMRect,
    showAll: (extent: Extent, from: string) => {
      asked.push(`all from ${from}, up to ${extent.maxM[2].toFixed(1)}`);
    },
    approach: ({ x, y, z }: Vector3, farM: number) => {
      asked.push(`${[x, y, z].map((v) => v.toFixed(1)).join(' ')} from ${farM}`);
    },
    flyTo: ({ position, target }) => {
      asked.push(`${position.toArray().join(' ')} to ${target.sub(position).toArray().map(Math.round).join(' ')}`);
    },
    place: (pose) => {
      asked.push(`placed at ${pose.join(' ')}`);
    },
  };
  store = createStore();
  const plan = smallPlan();
  const stage = {
    floors: plan.floors.map(({ id, name, elevation_m }, index) => ({
      id,
      name,
      index,
      elevationM: elevation_m,
      topM: elevation_m + 2.8,
      groundAreaM2: 70,
    })),
    stations: plan.stations.map(({ id, floor, order }) => ({ id, floorId: floor, order, positionM: [order, 0, 1] })),
    offsetM: [0, 0, 0],
  };
  const loaded = { plan, stage } as unknown as LoadedPlan;
  store.loaded.value = loaded;
  store.extents.value = { whole: { minM: [0, 0, 0], maxM: [10, 8, 5.6] }, grounds: new Map() };
  flights = new Flights({
    store,
    loaded,
    viewport: viewport as Viewport,
    picker: { firstHit: () => null } as unknown as SurfacePicker,
    isHidden: () => false,
    places: () => {
      throw new Error('nothing here asks for patches');
    },
    walkAt: (pose) => {
      asked.push(`walk at ${pose.join(' ')}`);
    },
  });
});

const since = (change: () => void): string[] => {
  asked = [];
  change();
  return asked;
};

test('the camera begins where all is in the picture, and follows the choice of floor', () => {
  expect(asked).toHaveLength(1);
  expect(asked[0]).toMatch(/^all from side/);
  expect(since(() => store.chooseFloor('F0'))).toEqual(['all from side, up to 1.6']);
});

test('the slider of the cut and hidden ceilings leave the camera where it is', () => {
  expect(
    since(() => {
      store.cutM.value = 2.2;
      store.hidesCeilings.value = true;
    }),
  ).toEqual([]);
});

test('the camera comes near to a chosen station, but not while it is edited', () => {
  expect(since(() => store.chooseStation('S001'))).toEqual(['1.0 0.0 1.0 from 15']);
  store.tab.value = 'edit';
  expect(since(() => store.chooseStation('S002'))).toEqual([]);
});

test('a pair is shown with both ends in the picture', () => {
  expect(since(() => store.choosePair(['S001', 'S002'])).at(-1)).toBe('1.5 0.0 1.0 from 10');
});

test('a look from a station begins at its sensor', () => {
  expect(since(() => flights.lookFrom('S001', { azimuthRad: Math.PI / 2, elevationRad: 0 }))).toEqual([
    '1 0 1 to 0 1 0',
  ]);
  expect(since(() => flights.lookFrom('S009', { azimuthRad: 0, elevationRad: 0 }))).toEqual([]);
});

test('the address places the camera, unless it says where the hand has just put it', () => {
  const pose = [1, 2, 3, 4, 5, 6];
  expect(since(() => viewport.onMovedByHand(pose))).toEqual([]);
  expect(store.camera.value).toBe(pose);
  expect(since(() => (store.camera.value = [9, 8, 7, 6, 5, 4]))).toEqual(['placed at 9 8 7 6 5 4']);
  store.startsWalking.value = true;
  expect(since(() => (store.camera.value = [1, 1, 1, 2, 2, 2]))).toEqual(['walk at 1 1 1 2 2 2']);
  viewport.onFlight();
  expect(store.camera.value).toBeNull();
});

test('nothing moves the camera any more once it is disposed of', () => {
  flights.dispose();
  expect(since(() => store.chooseFloor('F1'))).toEqual([]);
});
