import { expect, test } from 'vitest';
import { createStore } from '../store.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { floorsInWords, plannedFloors } from './floors-compared.ts';
import { changesShown } from './station-changes.ts';

const of = (...floors: string[]) => ({ ...smallPlan(), requirements: { ...smallPlan().requirements, floors } });

test('a plan includes the floors it was asked for, by id or name, and else of all', () => {
  const ids = (...floors: string[]) => plannedFloors(of(...floors)).map(({ id }) => id);
  expect([ids(), ids('Upper floor'), ids('F0')]).toEqual([['F0', 'F1'], ['F1'], ['F0']]);
});

test('which floors each plan includes is said where they differ, and what is compared', () => {
  const words = (shown: string[], other: string[]) =>
    floorsInWords({ title: 'The plan', plan: of(...shown) }, { title: 'Run R001', plan: of(...other) });
  expect(words([], [])).toBeNull();
  expect(words(['F0'], ['ground floor'])).toBeNull();
  expect(words([], ['F0', 'F1'])).toBeNull();
  expect(words([], ['F0'])).toBe(
    'The plan includes Ground floor and Upper floor; Run R001 includes Ground floor. Only Ground floor is compared.',
  );
  expect(words(['F1'], ['F0'])).toMatch(/No floor is in both/);
});

test('stations of floors that only one plan includes are not told as gone', () => {
  const store = createStore();
  const plan = of('F0');
  store.loaded.value = { plan, stage: { offsetM: [0, 0, 0], stations: [] } } as never;
  const other = { base: 'runs/R001/plan', title: 'Run R001', plan: of(), patchSeen: new Uint8Array(0) };
  expect(changesShown(store)).toEqual([]);
  store.comparison.value = { kind: 'shown', other };
  expect(changesShown(store).map(({ kind, floorId }) => [kind, floorId])).toEqual([
    ['gone', 'F0'],
    ['gone', 'F0'],
  ]);
});
