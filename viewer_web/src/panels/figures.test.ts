/** Figures as people read them. */
import { expect, test } from 'vitest';
import { runPython } from '../testing/python.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { alongWays, askedPercent, optimalityInWords, overlapDefined, overlapNoun, reachedPercent } from './figures.ts';

test('what is just short of what is required never reads as enough', () => {
  const words = (share: number) => reachedPercent(share, 0.3);
  expect([0.2999999, 0.2996, 0.2994, 0.3, 0].map(words)).toEqual([
    'just below 30 %',
    'just below 30 %',
    '29.9 %',
    '30.0 %',
    '0.0 %',
  ]);
  expect([reachedPercent(0.06996, 0.07), reachedPercent(0.2958, 0.296)]).toEqual([
    'just below 7 %',
    'just below 29.6 %',
  ]);
});

test('overlap is named as the library names it, and said to be a share of what it is', () => {
  const script = [
    'import json',
    'from planner_core.model import OverlapMeasure, OverlapOf',
    'from planner_core.requirements.wording import overlap_noun',
    'print(json.dumps([[m, of, overlap_noun(m, of)] for m in OverlapMeasure for of in OverlapOf]))',
  ].join('\n');
  type Way = Parameters<typeof overlapNoun>[0];
  type Row = [Way['overlap_measure'], Way['overlap_of'], string];
  const rows = JSON.parse(runPython('-c', script)) as Row[];
  const told = rows.map(([overlap_measure, overlap_of]) => overlapNoun({ overlap_measure, overlap_of }));
  expect(told).toEqual(rows.map(([, , noun]) => noun));
  expect(told).toContain('Jaccard overlap of what is seen as required');
  expect(overlapDefined({ overlap_measure: 'smaller-share', overlap_of: 'all-seen' })).toMatch(/seen area of each/);
  expect(overlapDefined({ overlap_measure: 'jaccard', overlap_of: 'seen-as-required' })).toBe(
    'Shared part of the area seen as required of both stations together (Jaccard)',
  );
});

test('a plan of before overlap had a name measures it as it did', () => {
  const { overlap_measure, overlap_of } = smallPlan().requirements;
  expect([overlap_measure, overlap_of]).toEqual(['smaller-share', 'all-seen']);
});

test('a share reads as the library writes it in report, sheets and summary, met or short of what is required', () => {
  const near = Array.from({ length: 401 }, (_, i) => i / 400).flatMap((share) =>
    [share, share - 4e-4, share - 1e-10, share + 2.5e-4, share + 5e-4].flatMap((one) =>
      [0.95, 0.3, 0].map((required) => [Math.max(0, one), required] as const),
    ),
  );
  const script = [
    'import json, sys',
    'from planner_core.coverage.percent import reached_percent',
    'print(json.dumps([reached_percent(*pair) + " %" for pair in json.loads(sys.argv[1])]))',
  ].join('\n');
  const told = JSON.parse(runPython('-c', script, JSON.stringify(near)));
  expect(near.map(([share, required]) => reachedPercent(share, required))).toEqual(told);
  expect([0.94996, 0.95, 0.9516].map((share) => reachedPercent(share, 0.95))).toEqual([
    'just below 95 %',
    '95.0 %',
    '95.2 %',
  ]);
});

test('what is asked keeps the digits it was asked with', () => {
  expect([0.3, 0.295, 0.07, 1 / 3].map(askedPercent)).toEqual(['30 %', '29.5 %', '7 %', '33.3333 %']);
});

test('how far a plan may be from the minimum is told in stations', () => {
  const words = (lower_bound: number | null, gap: number | null, proven = false): string =>
    optimalityInWords({ stations: 28, lower_bound, gap, proven });
  expect(words(28, 0, true)).toBe('proven minimum');
  expect(words(26, 2 / 28)).toBe('up to 2 stations above the minimum');
  expect(words(27, 1 / 28)).toBe('up to 1 station above the minimum');
  expect(words(26, null)).toBe('unknown');
});

test('a figure of the route names the legs that it leaves out', () => {
  expect(alongWays('174 m', 0)).toBe('174 m');
  expect(alongWays('174 m', 1)).toBe('174 m, without 1 leg that has no way');
  expect(alongWays('2 h 03 min', 2)).toBe('2 h 03 min, without 2 legs that have no way');
});
