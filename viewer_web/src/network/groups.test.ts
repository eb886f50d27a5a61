import { expect, test } from 'vitest';
import { GroundMap } from '../edit/ground-map.ts';
import { joinPlaces } from '../ghost/join-places.ts';
import { rgbOf } from '../heat/colors.ts';
import type { PlanLink } from '../load/plan-json.ts';
import { networkOf } from './graph.ts';
import { GROUP_COLORS, groupColor, groupsOf, joinsInWords, numberByStation, whyApart } from './groups.ts';

const COUNTING = { threshold: 0.3, minStrength: 0.001, minProbability: 0 };
const link = (a: string, b: string, overlap: number, strength = 0.1): PlanLink =>
  ({ a, b, overlap, strength, weak_motion: null, probability: null, as_set_up: false }) as unknown as PlanLink;

test('groups have members, colours, and the link that comes nearest to joining them with what it lacks', () => {
  const links = [link('A', 'B', 0.5), link('B', 'C', 0.29), link('A', 'C', 0.1), link('C', 'D', 0.9, 0.0005)];
  const groups = groupsOf(networkOf(['A', 'B', 'C', 'D', 'E'], links, COUNTING));
  expect(groups.map(({ stations }) => stations)).toEqual([['A', 'B'], ['C'], ['D'], ['E']]);
  expect(groups.map((group) => whyApart(group, COUNTING))).toEqual([
    'nearest: B – C, 29.0 %, overlap below 30 %',
    'nearest: B – C, 29.0 %, overlap below 30 %',
    'nearest: C – D, 90.0 %, strength below 0.001',
    'shares no surface worth listing with another group',
  ]);
  expect(numberByStation(groups).get('D')).toBe(3);
  expect(groupColor(1 + GROUP_COLORS.length)).toBe(groupColor(1));
});

test('stations that are there for the network alone have what they join in words', () => {
  const joins = [
    { stations: ['S003', 'S007'], n_groups: 2, floors: ['F0'] },
    { stations: ['S009'], n_groups: 1, floors: ['F0'] },
  ];
  expect(joinsInWords(joins)).toBe('S003 S007: joins 2 groups\nS009: makes the network hold as set up');
  expect(joinsInWords([])).toBe('');
});

test('white numbers are readable on the colour of every group', () => {
  const channel = (byte: number): number => (byte <= 10 ? byte / 3294.6 : ((byte / 255 + 0.055) / 1.055) ** 2.4);
  for (const color of GROUP_COLORS) {
    const [r, g, b] = rgbOf(color).map(channel);
    expect(1.05 / (0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05), color).toBeGreaterThan(4.5);
  }
});

/** Ground of 12 x 2 m in cells of half a metre; nothing stands in the first row of metres. */
function corridor(): GroundMap {
  const head = { floor: 'F0', origin: [0, 0], cell_m: 0.5, width: 24, height: 4 };
  return new GroundMap(
    head,
    Uint8Array.from({ length: 96 }, (_, i) => (i < 48 ? 1 : 2)),
  );
}

test('positions that might join groups are tried from amidst two of them on, a metre apart, where a tripod stands', () => {
  const at = (id: string, x: number) => ({ id, positionM: [x, 1.5, 1.6] as const });
  const floors = [{ ground: corridor(), elevationM: 0, heightM: 1.6 }];
  const places = joinPlaces([[at('A', 1)], [at('B', 7)], [at('C', 11)]], floors);
  const xs = places.map(({ positionM: [x] }) => x);
  // B and C are nearer to each other than A is to either: they are first, then both pairs take turns.
  expect(xs[0]).toBeGreaterThan(7);
  expect(xs[0]).toBeLessThan(11);
  expect(xs[1]).toBeGreaterThan(1);
  expect(xs[1]).toBeLessThan(7);
  expect(places.every(({ positionM: [, y, z] }) => y > 1 && z === 1.6)).toBe(true);
  const apart = places.flatMap((one, i) =>
    places.slice(i + 1).map((two) => Math.abs(one.positionM[0] - two.positionM[0])),
  );
  expect(Math.min(...apart)).toBeGreaterThan(0.9);
  expect(joinPlaces([[at('A', 1)]], floors)).toEqual([]);
});
