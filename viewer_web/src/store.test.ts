import { expect, test } from 'vitest';
import type { LoadedPlan } from './load/fetch-plan.ts';
import { createStore, type Store } from './store.ts';
import { smallPlan } from './testing/small-plan.ts';

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
  store.loaded.value = { plan, stage: { floors, stations: stageStations } } as unknown as LoadedPlan;
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
