import { expect, test } from 'vitest';
import type { PlanLink } from '../load/plan-json.ts';
import { type Counting, networkOf } from './graph.ts';
import { doorsWords, lackInWords, linkGroups, targetsWords } from './link-groups.ts';

const COUNTING: Counting = { threshold: 0.3, minStrength: 0.01, minProbability: 0 };
const link = (a: number, b: number, overlap: number, strength: number | null = 0.1): PlanLink => ({
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

// A triangle with one more station on a bridge, another that nothing reaches well enough, and a link of no use.
const LINKS = [
  link(0, 1, 0.5, 0.3),
  link(1, 2, 0.6, 0.1),
  link(0, 2, 0.7, 0.2),
  link(2, 3, 0.4),
  link(3, 4, 0.2),
  link(2, 4, 0.1),
  link(1, 3, 0.9, 0.001),
];
const report = networkOf(['S0', 'S1', 'S2', 'S3', 'S4'], LINKS, COUNTING);

test('every link is listed once, by what it is worth', () => {
  const groups = linkGroups(LINKS, report, COUNTING);
  const names = groups.map(({ title, links }) => [title, links.map(({ a, b }) => a + b)]);
  expect(names).toEqual([
    ['Missing links', ['S3S4']],
    ['Single-link connections', ['S2S3']],
    ['Registration links', ['S0S1', 'S0S2', 'S1S2']],
    ['Weak links', ['S1S3', 'S2S4']],
  ]);
});

test('groups without links are not there', () => {
  const ring = LINKS.slice(0, 3);
  const groups = linkGroups(ring, networkOf(['S0', 'S1', 'S2'], ring, COUNTING), COUNTING);
  expect(groups.map(({ title }) => title)).toEqual(['Registration links']);
});

test('a link that does not count says what it lacks', () => {
  expect(lackInWords(LINKS[0], COUNTING)).toBeNull();
  expect(lackInWords(LINKS[4], COUNTING)).toBe('overlap below 30 %');
  expect(lackInWords(LINKS[6], COUNTING)).toBe('strength below 0.01');
  expect(lackInWords(link(0, 1, 0.5, null), COUNTING)).toBeNull();
  expect(lackInWords({ ...LINKS[4], as_set_up: true }, COUNTING)).toBeNull();
});

test('two stations that see three targets register, whatever they have in common', () => {
  const targets = [
    [1, 2, 3],
    [4, 5.125, 6],
    [7, 8, 9],
  ] as [number, number, number][];
  const least = { ...link(0, 1, 0.01), targets };
  expect(lackInWords(least, COUNTING)).toBeNull();
  expect(targetsWords(least)).toBe('(1.00, 2.00, 3.00) (4.00, 5.13, 6.00) (7.00, 8.00, 9.00)');
  expect(targetsWords(link(0, 1, 0.5))).toBeNull();
  expect(networkOf(['S0', 'S1'], [least], COUNTING).components).toHaveLength(1);
});

test('a link names the doors that it needs, and does not count where doors change', () => {
  const through = { ...link(0, 1, 0.5), only_open: ['1a', '2b'] };
  expect(doorsWords(through)).toBe('only with 2 open: 1a, 2b');
  expect(doorsWords({ ...link(0, 1, 0.2), only_shut: ['1a'] })).toBe('would register with 1 shut: 1a');
  expect(doorsWords(link(0, 1, 0.5))).toBeNull();
  expect(lackInWords(through, COUNTING)).toBeNull();
  expect(lackInWords(through, { ...COUNTING, doorsChange: true })).toBe('needs an open door');
  expect(lackInWords(link(0, 1, 0.5), { ...COUNTING, doorsChange: true })).toBeNull();
});
