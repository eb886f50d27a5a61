import { expect, test } from 'vitest';
import { APART_X, APART_Y, type Numbered, type Offset, Spreader } from './spreading.ts';

const at = (id: string, x: number, y: number, isPinned = false): Numbered => ({ id, x, y, isPinned });
const lengthOf = ({ x, y }: Offset): number => Math.hypot(x, y);

/** Distance of two numbers as they are drawn, 1 at that at which they read well; from 0.94 on they do not touch. */
function apart(numbers: readonly Numbered[], offsets: ReadonlyMap<string, Offset>): number {
  const drawn = numbers.map(({ id, x, y }) => ({ x: x + offsets.get(id)!.x, y: y + offsets.get(id)!.y }));
  const gaps = drawn.flatMap((a, i) =>
    drawn.slice(i + 1).map((b) => Math.max(Math.abs(a.x - b.x) / APART_X, Math.abs(a.y - b.y) / APART_Y)),
  );
  return Math.min(...gaps);
}

function randomly(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1103515245) + 12345) & 0x7fffffff;
    return state / 0x7fffffff;
  };
}

test('numbers that have room stay at their stations', () => {
  const numbers = [at('a', 0, 0), at('b', 40, 0), at('c', 0, 30)];
  expect([...new Spreader().offsets(numbers).values()].map(lengthOf)).toEqual([0, 0, 0]);
});

test('stations at one spot stand side by side around it', () => {
  for (const n of [2, 3, 4, 7]) {
    const numbers = [...Array(n).keys()].map((i) => at(`S${i}`, 200, 100));
    const offsets = new Spreader().offsets(numbers);
    expect(apart(numbers, offsets), `${n}`).toBeGreaterThan(0.94);
    const sum = [...offsets.values()].reduce((all, { x, y }) => ({ x: all.x + x, y: all.y + y }), { x: 0, y: 0 });
    expect(lengthOf(sum) / n, `${n}`).toBeLessThan(1);
    for (const offset of offsets.values()) expect(lengthOf(offset), `${n}`).toBeLessThan(n === 2 ? 22 : 50);
  }
});

test('the chosen number stays at its station, and the others make room', () => {
  const numbers = [at('a', 50, 50), at('b', 53, 48, true), at('c', 47, 55)];
  const offsets = new Spreader().offsets(numbers);
  expect(lengthOf(offsets.get('b')!)).toBe(0);
  expect(apart(numbers, offsets)).toBeGreaterThan(0.94);
});

test('no two of a crowd touch, and none is far from its station', () => {
  for (let seed = 1; seed <= 20; seed++) {
    const next = randomly(seed);
    const numbers = [...Array(30).keys()].map((i) => at(`S${i}`, 360 * next(), 240 * next()));
    const offsets = new Spreader().offsets(numbers);
    expect(apart(numbers, offsets), `seed ${seed}`).toBeGreaterThan(0.94);
    expect(Math.max(...[...offsets.values()].map(lengthOf)), `seed ${seed}`).toBeLessThan(60);
  }
});

test('one moved alone, as if it were not near others, goes nowhere', () => {
  const offsets = new Spreader().offsets([at('a', 0, 0), at('b', 3, 3), at('c', 400, 0)]);
  expect(offsets.get('c')).toEqual({ x: 0, y: 0 });
});

test('the same picture again moves nothing', () => {
  const next = randomly(5);
  const numbers = [...Array(25).keys()].map((i) => at(`S${i}`, 250 * next(), 200 * next()));
  const spreader = new Spreader();
  let before = spreader.offsets(numbers);
  const first = before;
  for (let i = 0; i < 20; i++) {
    const after = spreader.offsets(numbers);
    for (const [id, { x, y }] of after) {
      expect(lengthOf({ x: x - before.get(id)!.x, y: y - before.get(id)!.y })).toBeLessThan(1.5);
      expect(lengthOf({ x: x - first.get(id)!.x, y: y - first.get(id)!.y })).toBeLessThan(6);
    }
    before = after;
  }
});

test('a number stays on its side while its station passes behind another', () => {
  const spreader = new Spreader();
  let last: Offset | null = null;
  for (let x = -12; x <= 8; x += 0.5) {
    const offset = spreader.offsets([at('a', 100, 100), at('b', 100 + x, 100 + 0.1 * x)]).get('b')!;
    const drawn = { x: x + offset.x, y: 0.1 * x + offset.y };
    if (last !== null) expect(lengthOf({ x: drawn.x - last.x, y: drawn.y - last.y }), `${x}`).toBeLessThan(3);
    expect(drawn.x, `${x}`).toBeLessThan(0);
    last = drawn;
  }
});

test('once the stations are apart the numbers are back at them', () => {
  const spreader = new Spreader();
  spreader.offsets([at('a', 0, 0), at('b', 0, 0)]);
  expect([...spreader.offsets([at('a', 0, 0), at('b', 90, 0)]).values()].map(lengthOf)).toEqual([0, 0]);
});

test('a number that its station left on the other side of others comes after it', () => {
  const spreader = new Spreader();
  spreader.offsets([at('a', 0, 0), at('b', -5, 0), at('c', 5, 0)]);
  const swapped = [at('a', 0, 0), at('b', 40, 0), at('c', -40, 0), at('d', 44, 0)];
  const offsets = spreader.offsets(swapped);
  for (const id of ['a', 'b', 'c', 'd']) expect(lengthOf(offsets.get(id)!), id).toBeLessThan(20);
});
