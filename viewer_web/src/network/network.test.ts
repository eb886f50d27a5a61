import { expect, test } from 'vitest';
import type { PlanLink } from '../load/plan-json.ts';
import type { ShownStation } from '../stations/shown.ts';
import { type Counting, linkPercent, networkOf } from './graph.ts';
import { layOut } from './graph-layout.ts';
import { overlapColor, strengthColor, strengthInWords, strengthShare } from './strength.ts';

const COUNTING: Counting = { threshold: 0.3, minStrength: 0.01, minProbability: 0 };
const link = (a: number, b: number, overlap = 0.5, strength: number | null = 0.1): PlanLink => ({
  a: `S${a}`,
  b: `S${b}`,
  overlap,
  strength,
  weak_axis: '',
  weak_motion: null,
  as_set_up: false,
  only_open: [],
  only_shut: [],
  targets: [],
  probability: null,
});
const ids = (n: number): string[] => [...Array(n).keys()].map((i) => `S${i}`);
const nameOf = ({ a, b }: PlanLink): string => `${a}-${b}`;

test('a chain hangs on every link and on all but its ends', () => {
  const { components, bridges, articulations, weakest } = networkOf(
    ids(4),
    [link(0, 1, 0.9), link(1, 2, 0.4), link(2, 3, 0.6)],
    COUNTING,
  );
  expect(components).toEqual([ids(4)]);
  expect([...bridges].map(nameOf).sort()).toEqual(['S0-S1', 'S1-S2', 'S2-S3']);
  expect([...articulations].sort()).toEqual(['S1', 'S2']);
  expect(weakest && nameOf(weakest)).toBe('S1-S2');
});

test('a ring hangs on nothing, and its least link is not its weakest: the ring goes round it', () => {
  const ring = [link(0, 1, 0.8), link(1, 2, 0.7), link(2, 0, 0.31)];
  const { bridges, articulations, weakest } = networkOf(ids(3), ring, COUNTING);
  expect(bridges.size).toBe(0);
  expect(articulations.size).toBe(0);
  expect(weakest && nameOf(weakest)).toBe('S1-S2');
});

test('the weakest link is the one nearest to what is required, of overlap or of strength', () => {
  const names = ['S6', 'S9', 'S21', 'S23'];
  const weakestOf = (strength: number | null): string => {
    const chain = [link(6, 9, 0.302, 0.205), link(9, 21, 0.5, 0.1), link(21, 23, 0.45, strength)];
    return nameOf(networkOf(names, chain, COUNTING).weakest as PlanLink);
  };
  expect(weakestOf(0.021)).toBe('S6-S9'); // 1.007 times the overlap, 2.1 times the strength
  expect(weakestOf(0.01)).toBe('S21-S23');
  expect(weakestOf(null)).toBe('S6-S9');
  const free = networkOf(names, [link(6, 9, 0.302, 0.2), link(9, 21, 0.5, 0.1)], {
    threshold: 0,
    minStrength: 0,
    minProbability: 0,
  });
  expect(free.weakest && nameOf(free.weakest)).toBe('S6-S9');
});

test('what decides is the probability where one is required, never said to be certain', () => {
  const counting = { threshold: 0, minStrength: 0.01, minProbability: 0.99 };
  const likely = { ...link(0, 1, 0.14), probability: 0.99996 };
  const risky = { ...link(1, 2, 0.6), probability: 0.98996 };
  expect([likely, risky, link(0, 2)].map((each) => linkPercent(each, counting))).toEqual([
    '99.9 %',
    'just below 99 %',
    '50.0 %',
  ]);
  const report = networkOf(['S0', 'S1', 'S2'], [likely, risky], counting);
  expect([report.counting.length, report.components.length]).toEqual([1, 2]);
  expect(report.gaps).toEqual([risky]);
});

test('links below the threshold or too weak do not count; of unknown strength they do', () => {
  const links = [link(0, 1, 0.29), link(1, 2, 0.9, 0.001), link(2, 3, 0.3, null)];
  const { counting, components, gaps } = networkOf(ids(4), links, COUNTING);
  expect(counting.map(nameOf)).toEqual(['S2-S3']);
  expect(components).toEqual([['S2', 'S3'], ['S0'], ['S1']]);
  expect(gaps.map(nameOf)).toEqual(['S0-S1', 'S1-S2']);
});

/** Splitmix, so that a failure is one seed. */
function random(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x9e3779b9) | 0;
    let z = Math.imul(state ^ (state >>> 16), 0x85ebca6b);
    z = Math.imul(z ^ (z >>> 13), 0xc2b2ae35);
    return ((z ^ (z >>> 16)) >>> 0) / 2 ** 32;
  };
}

/** Number of components, by flooding; the oracle of what follows. */
function nParts(names: readonly string[], links: readonly PlanLink[]): number {
  const left = new Set(names);
  let n = 0;
  for (const root of names) {
    if (!left.delete(root)) continue;
    n++;
    const stack = [root];
    for (let id = stack.pop(); id !== undefined; id = stack.pop()) {
      for (const { a, b } of links) {
        const other = a === id ? b : b === id ? a : null;
        if (other !== null && left.delete(other)) stack.push(other);
      }
    }
  }
  return n;
}

test.each([...Array(40).keys()])(
  'bridges and articulations are what splits a network when taken out, seed %i',
  (seed) => {
    const next = random(seed + 1);
    const names = ids(9);
    const links: PlanLink[] = [];
    for (let a = 0; a < 9; a++) {
      for (let b = a + 1; b < 9; b++) if (next() < 0.22) links.push(link(a, b, 0.3 + 0.7 * next()));
    }
    const { components, bridges, articulations, weakest } = networkOf(names, links, COUNTING);
    const n = nParts(names, links);
    expect(components.length).toBe(n);
    const parting = links.filter(
      (one) =>
        nParts(
          names,
          links.filter((other) => other !== one),
        ) > n,
    );
    expect([...bridges].map(nameOf).sort()).toEqual(parting.map(nameOf).sort());
    const cut = names.filter((id) => {
      const others = names.filter((other) => other !== id);
      const isAlone = !links.some(({ a, b }) => a === id || b === id);
      return (
        !isAlone &&
        nParts(
          others,
          links.filter(({ a, b }) => a !== id && b !== id),
        ) > n
      );
    });
    expect([...articulations].sort()).toEqual(cut.sort());
    // Without all links of as little overlap some two stations lose each other.
    const least = weakest?.overlap ?? 0;
    if (weakest !== null)
      expect(
        nParts(
          names,
          links.filter(({ overlap }) => overlap > least),
        ),
      ).toBeGreaterThan(n);
    expect(
      nParts(
        names,
        links.filter(({ overlap }) => overlap >= least),
      ),
    ).toBe(n);
  },
);

const station = (order: number, floorId: string, x: number, y: number): ShownStation => ({
  id: `S${order}`,
  number: order,
  order,
  floorId,
  positionM: [x, y, 1.5],
  marks: [],
});

test('the graph keeps stations of a floor in its strip, apart from each other and inside', () => {
  const stations = [...Array(20).keys()].map((i) => station(i, i % 2 ? 'F0' : 'F1', (i * 7) % 5, 0.1 * i));
  const { places, floors, height } = layOut(stations, ['F1', 'F0'], { width: 300, gap: 20 });
  expect(floors.map(({ id }) => id)).toEqual(['F1', 'F0']);
  const of = (floorId: string) => stations.filter((one) => one.floorId === floorId).map(({ id }) => places.get(id)!);
  for (const { x, y } of places.values()) {
    expect(x).toBeGreaterThanOrEqual(0);
    expect(x).toBeLessThanOrEqual(300);
    expect(y).toBeGreaterThan(0);
    expect(y).toBeLessThan(height);
  }
  expect(Math.max(...of('F1').map(({ y }) => y))).toBeLessThan(Math.min(...of('F0').map(({ y }) => y)));
  const apart = of('F0').flatMap((a, i) =>
    of('F0')
      .slice(i + 1)
      .map((b) => Math.hypot(a.x - b.x, a.y - b.y)),
  );
  expect(Math.min(...apart)).toBeGreaterThan(10);
});

test('stations at one place are laid apart, and one alone is laid', () => {
  const two = layOut([station(1, 'F0', 0, 0), station(2, 'F0', 0, 0)], ['F0'], { width: 200, gap: 20 });
  const [a, b] = [...two.places.values()];
  expect(Math.hypot(a.x - b.x, a.y - b.y)).toBeGreaterThan(10);
  expect(layOut([station(1, 'F0', 3, 3)], ['F0'], { width: 200, gap: 20 }).places.size).toBe(1);
  expect(layOut([], ['F0'], { width: 200, gap: 20 }).height).toBe(0);
});

test('stronger links are further along the colours, which all are colours', () => {
  const shares = [0, 0.004, 0.01, 0.05, 0.2, 1].map(strengthShare);
  expect([...shares].sort((a, b) => a - b)).toEqual(shares);
  expect([shares[0], shares[5]]).toEqual([0, 1]);
  for (const strength of [null, 0, 0.01, 0.07, 0.2, 1]) {
    for (const isDark of [false, true]) expect(strengthColor(strength, isDark)).toMatch(/^#[0-9a-f]{6}$/);
  }
  expect(overlapColor(0, false)).not.toBe(overlapColor(1, false));
  expect(strengthInWords(null)).toBe('not computed');
  expect(strengthInWords(0.006)).toBe('0.006 (weak)');
  expect(strengthInWords(0.5)).toBe('0.500 (strong)');
});
