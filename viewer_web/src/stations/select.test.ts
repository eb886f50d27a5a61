import { expect, test } from 'vitest';
import { createStore } from '../store.ts';
import { clickStation, selectNone } from './select.ts';

const PLAIN = { shiftKey: false };
const SHIFT = { shiftKey: true };

test('Shift adds to what is chosen and takes away again; a plain click chooses one alone', () => {
  const store = createStore();
  clickStation(store, 'S001', PLAIN);
  expect([store.stationId.value, [...store.selection.value]]).toEqual(['S001', []]);
  clickStation(store, 'S002', SHIFT);
  clickStation(store, 'S003', SHIFT);
  expect([store.stationId.value, [...store.selection.value]]).toEqual([null, ['S001', 'S002', 'S003']]);
  clickStation(store, 'S002', SHIFT);
  expect([...store.selection.value]).toEqual(['S001', 'S003']);
  clickStation(store, 'S005', PLAIN);
  expect([store.stationId.value, [...store.selection.value]]).toEqual(['S005', []]);
});

test('fingers select several without Shift once they are asked to, until it ends', () => {
  const store = createStore();
  store.selectsSeveral.value = true;
  for (const id of ['S001', 'S002']) clickStation(store, id, PLAIN);
  expect([...store.selection.value]).toEqual(['S001', 'S002']);
  selectNone(store);
  clickStation(store, 'S002', PLAIN);
  expect([store.stationId.value, [...store.selection.value]]).toEqual(['S002', []]);
  clickStation(store, 'S002', PLAIN, true);
  expect(store.stationId.value).toBeNull();
});

test('Escape lets go of several as of one', () => {
  const store = createStore();
  for (const id of ['S001', 'S002']) clickStation(store, id, SHIFT);
  store.floorId.value = 'F0';
  store.clear();
  expect(store.selection.value.size).toBe(0);
  expect(store.floorId.value).toBe('F0');
});
