import { expect, test } from 'vitest';
import { DEFAULT_CUT_M } from './floors/cut.ts';
import type { LoadedPlan } from './load/fetch-plan.ts';
import type { UnseenSurface } from './load/plan-json.ts';
import type { StageElement } from './load/stage.ts';
import type { Picked } from './scene/state.ts';
import { createStore, type Store } from './store.ts';
import { smallPlan } from './testing/small-plan.ts';

/** Of two files. */
const ELEMENTS = [3, 4].map((sceneIndex, file) => ({ sceneIndex, file })) as unknown as StageElement[];

function storeWithPlan(): Store {
  const store = createStore();
  const plan = smallPlan();
  const floors = plan.floors.map((floor, index) => ({
    id: floor.id,
    name: floor.name,
    index,
    elevationM: floor.elevation_m,
    topM: floor.elevation_m + 2.8,
    groundAreaM2: 70,
  }));
  const stageStations = plan.stations.map(({ id, floor, order }) => ({
    id,
    floorId: floor,
    order,
    positionM: [0, 0, 0],
  }));
  store.loaded.value = {
    plan,
    stage: { floors, stations: stageStations, elements: ELEMENTS, offsetM: [0, 0, 0] },
  } as unknown as LoadedPlan;
  const whole = { minM: [0, 0, 0] as [number, number, number], maxM: [10, 8, 5.6] as [number, number, number] };
  store.extents.value = { whole, grounds: new Map() };
  return store;
}

test('choosing a floor lets go of a station of another floor and keeps one of its own', () => {
  const store = storeWithPlan();
  store.chooseStation('S001');
  store.chooseFloor('F0');
  expect(store.stationId.value).toBe('S001');
  store.chooseFloor('F1');
  expect(store.stationId.value).toBeNull();
});

test('choosing a station opens its floor', () => {
  const store = storeWithPlan();
  store.chooseStation('S003');
  expect(store.floorId.value).toBe('F1');
  store.chooseStation('S001');
  expect(store.floorId.value).toBe('F0');
});

test('stepping through stations stays on the shown floor and goes round', () => {
  const store = storeWithPlan();
  store.chooseFloor('F0');
  const seen = [1, 1, 1, -1].map((step) => {
    store.stepStation(step);
    return store.stationId.value;
  });
  expect(seen).toEqual(['S001', 'S002', 'S001', 'S002']);
});

test('clearing lets go of the choice first and of the floor second', () => {
  const store = storeWithPlan();
  store.chooseFloor('F1');
  store.chooseStation('S003');
  store.clear();
  expect([store.stationId.value, store.floorId.value]).toEqual([null, 'F1']);
  store.clear();
  expect(store.floorId.value).toBeNull();
});

test('slices follow the chosen floor', () => {
  const store = storeWithPlan();
  expect(store.slices.value.map((slice) => slice.floorId)).toEqual(['F0', 'F1']);
  store.isSpread.value = false;
  expect(store.slices.value.map((slice) => slice.floorId)).toEqual([null]);
  store.chooseFloor('F1');
  expect(store.slices.value.map((slice) => slice.floorId)).toEqual(['F1']);
});

const SURFACE = {
  element: 4,
  floor: 'F1',
  pieces: [
    {
      area_m2: 1,
      centroid: [0, 0, 5],
      box: [
        [0, 0, 5],
        [1, 1, 5.2],
      ],
      patch: 7,
    },
  ],
} as unknown as UnseenSurface;

test('one thing is chosen at a time', () => {
  const store = storeWithPlan();
  store.chooseStation('S001');
  store.choosePair(['S001', 'S002']);
  expect([store.stationId.value, store.pair.value]).toEqual([null, ['S001', 'S002']]);
  expect(store.floorId.value).toBe('F0');
  store.lookAtUnseen({ surface: SURFACE, piece: 0 });
  expect([store.pair.value, store.unseenFocus.value?.piece]).toEqual([null, 0]);
  store.chooseStation('S003');
  expect(store.unseenFocus.value).toBeNull();
  store.clear();
  expect([store.stationId.value, store.floorId.value]).toEqual([null, 'F1']);
});

test('a pair of two floors shows all floors', () => {
  const store = storeWithPlan();
  store.chooseFloor('F0');
  store.choosePair(['S002', 'S003']);
  expect(store.floorId.value).toBeNull();
});

test('looking at an unseen piece opens its floor and raises the cut above the piece', () => {
  const store = storeWithPlan();
  store.lookAtUnseen({ surface: SURFACE, piece: 0 });
  expect(store.floorId.value).toBe('F1');
  expect(store.cutM.value).toBeGreaterThan(2.4);
  expect(store.slices.value[0].topM).toBeGreaterThan(5.2);
  store.clear();
  expect(store.cutM.value).toBe(DEFAULT_CUT_M);
  store.lookAtUnseen({ surface: SURFACE, piece: 0 });
  store.cutM.value = 2;
  store.chooseStation('S001');
  expect(store.cutM.value).toBe(2);
});

test('stations are not edited through a piece above the cut: going to edit lets go of it, and of no piece below', () => {
  const store = storeWithPlan();
  store.lookAtUnseen({ surface: SURFACE, piece: 0 });
  store.tab.value = 'edit';
  expect([store.cutM.value, store.unseenFocus.value]).toEqual([DEFAULT_CUT_M, null]);
  expect(store.floorId.value).toBe('F1');
  store.tab.value = 'unseen';
  store.cutM.value = 2.7;
  store.lookAtUnseen({ surface: SURFACE, piece: 0 });
  store.tab.value = 'edit';
  expect(store.unseenFocus.value).not.toBeNull();
});

test('hiding a file lets go of a surface of it, and looking at an unseen piece shows its file', () => {
  const store = storeWithPlan();
  const [ofFirst, ofSecond] = ELEMENTS.map((element) => ({ element }) as unknown as Picked);
  store.pick(ofFirst);
  store.showFile(1, false);
  expect([store.picked.value, [...store.hiddenFiles.value]]).toEqual([ofFirst, [1]]);
  store.showFile(1, true);
  store.pick(ofSecond);
  store.showFile(1, false);
  store.showFile(0, false);
  expect([store.picked.value, [...store.hiddenFiles.value]]).toEqual([null, [1, 0]]);
  store.lookAtUnseen({ surface: SURFACE, piece: 0 });
  expect([...store.hiddenFiles.value]).toEqual([0]);
  store.clear();
  expect([...store.hiddenFiles.value]).toEqual([0]);
});

test('stations and links of a draft go before those of the plan', () => {
  const store = storeWithPlan();
  expect(store.shownStations.value).toHaveLength(3);
  expect(store.shownLinks.value).toHaveLength(2);
  store.draft.value = { stations: store.shownStations.value.slice(0, 1), links: [] };
  expect(store.shownStations.value).toHaveLength(1);
  expect(store.shownLinks.value).toEqual([]);
  store.draft.value = null;
  expect(store.shownStations.value).toHaveLength(3);
});

test('while walking nothing is cut', () => {
  const store = storeWithPlan();
  store.chooseFloor('F0');
  store.isWalking.value = true;
  expect(store.slices.value).toMatchObject([{ floorId: null, liftM: 0 }]);
});

test('layers of others stand beside those of the plan', () => {
  const store = storeWithPlan();
  const ids = (): string[] => store.layers.value.map(({ id }) => id);
  expect(ids()).toEqual(['times_seen', 'seen']);
  const layer = { kind: 'classes' as const, id: 'difference', title: 'Difference', classes: [] };
  store.extraLayers.value = [{ layer, values: new Uint8Array(3) }];
  expect(ids()).toEqual(['times_seen', 'seen', 'difference']);
});
