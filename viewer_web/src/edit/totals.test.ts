import { expect, test } from 'vitest';
import { smallPlan } from '../testing/small-plan.ts';
import { countingLinks, planTotals, signedCount, signedPoints } from './totals.ts';

test('links count from the threshold and the least strength on', () => {
  const links = [
    { overlap: 0.3, strength: 0.01 },
    { overlap: 0.5, strength: 0.009 },
    { overlap: 0.29, strength: 0.5 },
    { overlap: 0.4, strength: null },
  ];
  expect(countingLinks(links, 0.3, 0.01)).toBe(2);
});

test("the plan's totals are its own figures", () => {
  const totals = planTotals(smallPlan());
  expect([totals.nStations, totals.coverage, totals.nLinks]).toEqual([3, 0.95, 1]);
  expect(totals.floors).toEqual([
    { id: 'F0', name: 'Ground floor', coverage: 0.95 },
    { id: 'F1', name: 'Upper floor', coverage: 0.95 },
  ]);
});

test('differences are written with their sign, and left out where there is none', () => {
  expect([2, 0, -1].map(signedCount)).toEqual(['+2', '', '−1']);
  expect([0.004, 0.0004, -0.0126, 0].map(signedPoints)).toEqual(['+0.4', '', '−1.3', '']);
});
