import { expect, test } from 'vitest';
import type { StationEdit } from '../api/documents.ts';
import { draftStations } from '../edit/draft.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { EMPTY_REVIEW, stationEdit as edit } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { nextStop, routeStops, wayLeft, wayTo } from './route.ts';
import { partnersOf, targetsOf } from './targets.ts';
import { readTicks, tickKey, writeTicks } from './ticks.ts';

const leg = (from: string | null, to: string | null, length_m: number | null) => ({
  from,
  to,
  length_m,
  floors: ['F0'],
  points: [],
});

function walked(start: boolean): PlanJson {
  const legs = [leg('S001', 'S003', 4), leg('S003', 'S002', 6)];
  const order = ['S001', 'S003', 'S002'];
  const route = {
    length_m: 10,
    n_unwalkable: 0,
    exact: true,
    start: null,
    end: null,
    returns: false,
    order,
    left_out: [],
    legs: start ? [leg(null, 'S001', 3), ...legs] : legs,
  };
  const plan = smallPlan();
  const stations = plan.stations.map((station) => ({ ...station, order: order.indexOf(station.id) + 1 }));
  return { ...plan, route, stations };
}

const stopsOf = (plan: PlanJson, stations: Record<string, StationEdit> = {}) =>
  routeStops(plan, draftStations(plan, { ...EMPTY_REVIEW, stations }));

test('stops come in the order of the walk, each with the way to it', () => {
  const stops = stopsOf(walked(true));
  expect(stops.map(({ stationId, wayM }) => [stationId, wayM])).toEqual([
    ['S001', 3],
    ['S003', 4],
    ['S002', 6],
  ]);
  expect(stops[1].floorName).toBe('Upper floor');
});

test('a plan without a walk is visited in its order, and ways are not known', () => {
  const stops = stopsOf(smallPlan());
  expect(stops.map(({ stationId }) => stationId)).toEqual(['S001', 'S002', 'S003']);
  expect(wayTo(stops[1], stops, new Set(['S001']))).toBeNull();
  expect(wayLeft(smallPlan(), stops, new Set())).toEqual({ lengthM: 0, nWithoutWay: 0 });
});

test('the way to the next stop begins where the last scan was', () => {
  const stops = stopsOf(walked(true));
  const to = (done: string[]) => {
    const next = nextStop(stops, new Set(done));
    return next && [next.stationId, wayTo(next, stops, new Set(done))];
  };
  expect(to([])).toEqual(['S001', 3]);
  expect(to(['S001'])).toEqual(['S003', 4]);
  expect(to(['S001', 'S003'])).toEqual(['S002', 6]);
  expect(to(['S003'])).toEqual(['S001', 3]);
  expect(to(['S001', 'S002', 'S003'])).toBeNull();
  const left = (done: string[]) => wayLeft(walked(true), stops, new Set(done)).lengthM;
  expect([[], ['S001'], ['S001', 'S003', 'S002']].map(left)).toEqual([13, 10, 0]);
});

test('what is left to walk counts the legs that it leaves out', () => {
  const plan = walked(true);
  const legs = [leg(null, 'S001', 3), leg('S001', 'S003', null), leg('S003', 'S002', 6)];
  const cut: PlanJson = { ...plan, route: { ...plan.route!, legs, length_m: 9, n_unwalkable: 1 } };
  const stops = stopsOf(cut);
  expect(wayLeft(cut, stops, new Set())).toEqual({ lengthM: cut.route!.length_m, nWithoutWay: 1 });
  expect(wayLeft(cut, stops, new Set(['S001']))).toEqual({ lengthM: 6, nWithoutWay: 1 });
  expect(wayLeft(cut, stops, new Set(['S001', 'S003']))).toEqual({ lengthM: 6, nWithoutWay: 0 });
  const without: PlanJson = { ...plan, route: { ...plan.route!, legs: [leg('S001', 'S003', 4)], left_out: ['S002'] } };
  expect(wayLeft(without, stopsOf(without), new Set())).toEqual({ lengthM: 4, nWithoutWay: 1 });
});

test('the way back to the start is left to walk until the end', () => {
  const plan = walked(true);
  const legs = [...plan.route!.legs, leg('S002', null, 7)];
  const back: PlanJson = { ...plan, route: { ...plan.route!, legs, length_m: 20, returns: true } };
  expect(wayLeft(back, stopsOf(back), new Set()).lengthM).toBe(20);
  expect(wayLeft(back, stopsOf(back), new Set(['S001', 'S003'])).lengthM).toBe(13);
});

test('stops are those of the review, and ways to and from edited ones are not known', () => {
  const stops = stopsOf(walked(true), {
    S003: edit({ removed: true }),
    S004: edit({ position_m: [1001, 2001, 1.3], floor: 'F0', instrument_height_m: 1.3, added: true }),
  });
  expect(stops.map(({ stationId, wayM }) => [stationId, wayM])).toEqual([
    ['S001', 3],
    ['S004', null],
    ['S002', null],
  ]);
  const [moved] = stopsOf(walked(true), { S001: edit({ position_m: [1002, 2001, 1.3], floor: 'F0' }) });
  expect([moved.positionM, moved.wayM]).toEqual([[1002, 2001, 1.3], null]);
});

test('from nowhere the way is not known', () => {
  const stops = stopsOf(walked(false));
  expect(wayTo(stops[0], stops, new Set())).toBeNull();
  expect(wayTo(stops[2], stops, new Set(['S001']))).toBe(10);
});

test('ticks are kept, and belong to one plan', () => {
  const kept = new Map<string, string>();
  const storage = {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, text: string) => void kept.set(key, text),
    removeItem: (key: string) => void kept.delete(key),
  };
  const plan = smallPlan();
  const key = tickKey(plan, '/a/');
  writeTicks(storage, key, new Set(['S002', 'S001']));
  expect([...readTicks(storage, key)].sort()).toEqual(['S001', 'S002']);
  const moved = {
    ...plan,
    stations: plan.stations.map((station) => ({ ...station, position: [0, 0, 0] as [number, number, number] })),
  };
  expect(readTicks(storage, tickKey(moved, '/a/')).size).toBe(0);
  expect(readTicks(storage, tickKey(plan, '/b/')).size).toBe(0);
  writeTicks(storage, key, new Set());
  expect(kept.size).toBe(0);
  for (const damaged of ['{', '{"a": 1}', 'null']) {
    kept.set(key, damaged);
    expect(readTicks(storage, key).size).toBe(0);
  }
});

test('the station that comes next names those that targets register it with, and the map where they hang', () => {
  const plan = smallPlan();
  const links = plan.registration.links.map((link, i) => ({
    ...link,
    targets:
      i === 0
        ? [
            [1, 2, 1],
            [5, 2, 1],
            [3, 2, 2],
          ].map(([x, y, z]) => [x, y, z] as [number, number, number])
        : [],
  }));
  const targeted = { ...plan, registration: { ...plan.registration, links } };
  const stops = stopsOf(targeted);
  const [{ a, b }] = links;
  const stopOf = (id: string) => stops.filter(({ stationId }) => stationId === id);
  expect(partnersOf(targeted, stopOf(a)[0])).toEqual([b]);
  expect(partnersOf(targeted, stopOf(b)[0])).toEqual([a]);
  expect(targetsOf(targeted, stopOf(a)).map(({ positionM: [x] }) => x)).toEqual([1, 5, 3]);
  expect(targetsOf(targeted, [])).toEqual([]);
});
