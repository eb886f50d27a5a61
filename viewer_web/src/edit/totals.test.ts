import { expect, test } from 'vitest';
import { resultOf, smallPlan } from '../testing/small-plan.ts';
import { countingLinks, isAllMet, missedOf, planTotals, signedCount, signedPoints, type Totals } from './totals.ts';

test('links count from the threshold and the least strength on', () => {
  const links = [
    { overlap: 0.3, strength: 0.01, as_set_up: false },
    { overlap: 0.5, strength: 0.009, as_set_up: false },
    { overlap: 0.29, strength: 0.5, as_set_up: false },
    { overlap: 0.4, strength: null, as_set_up: false },
    { overlap: 0.26, strength: 0.04, as_set_up: true },
    { overlap: 0.5, strength: 0.3, as_set_up: false, probability: 0.98 },
    { overlap: 0.5, strength: 0.3, as_set_up: false, probability: 0.99 },
  ];
  expect(countingLinks(links, { threshold: 0.3, minStrength: 0.01, minProbability: 0.99 })).toBe(4);
});

test("the plan's totals are its own figures", () => {
  const totals = planTotals(smallPlan());
  expect([totals.nStations, totals.coverage, totals.nLinks]).toEqual([3, 0.95, 1]);
  expect(totals.floors).toEqual([
    { id: 'F0', name: 'Ground floor', coverage: 0.95, required: 0.95, nStations: 2 },
    { id: 'F1', name: 'Upper floor', coverage: 0.95, required: 0.95, nStations: 1 },
  ]);
});

test('floors that the plan is not of have no total', () => {
  const plan = smallPlan();
  for (const asked of ['F1', 'upper FLOOR']) {
    const some = { ...plan, requirements: { ...plan.requirements, floors: [asked] } };
    expect(planTotals(some).floors.map(({ id }) => id)).toEqual(['F1']);
  }
});

test('a floor has its own requirement where the client wrote it by its id', () => {
  const plan = smallPlan();
  const result = (name: string, required: number) =>
    resultOf({ name, required, fraction_of_achievable: 0.95, met: true });
  const results = [result('Ground floor', 0.95), result('F1', 0.85), result('overall', 0.95)];
  const totals = planTotals({ ...plan, requirements: { ...plan.requirements, results } });
  expect(totals.floors.map(({ required }) => required)).toEqual([0.95, 0.85]);
});

test('what is missed is told part by part, and of older plans as a whole', () => {
  const plan = smallPlan();
  const result = (name: string, met: boolean) => resultOf({ name, required: 0.95, fraction_of_achievable: 0.9, met });
  const results = [result('Ground floor', false), result('Stairs', true), result('overall', true)];
  const told = planTotals({ ...plan, requirements: { ...plan.requirements, results } });
  expect(missedOf(told.requirements)).toEqual([{ name: 'Ground floor', required: 0.95, coverage: 0.9, isMet: false }]);
  expect(missedOf(planTotals(plan).requirements)).toEqual([]);
  const asked = { ...plan.requirements, coverage: 0.96 };
  expect(missedOf(planTotals({ ...plan, requirements: asked }).requirements)).toMatchObject([{ name: 'overall' }]);
});

test('surfaces alone do not meet a plan whose network is required and falls apart', () => {
  const plan = smallPlan();
  const asking = (
    network: 'none' | 'connected' | 'redundant',
    of: number,
    bridges: [string, string][] = [],
  ): Totals => {
    const groups = Array.from({ length: of }, () => ({ stations: ['A', 'B', 'C'], bridges }));
    return planTotals({
      ...plan,
      requirements: { ...plan.requirements, network },
      registration: { ...plan.registration, networks: groups as never },
    });
  };
  expect(isAllMet(asking('connected', 1))).toBe(true);
  expect(isAllMet(asking('connected', 6))).toBe(false);
  expect(isAllMet(asking('none', 6))).toBe(true);
  expect(isAllMet(asking('connected', 1, [['A', 'B']]))).toBe(true);
  expect(isAllMet(asking('redundant', 1, [['A', 'B']]))).toBe(false);
  expect(isAllMet(asking('redundant', 1))).toBe(true);
});

test('differences are written with their sign, and left out where there is none', () => {
  expect([2, 0, -1].map(signedCount)).toEqual(['+2', '', '−1']);
  expect([0.004, 0.0004, -0.0126, 0].map(signedPoints)).toEqual(['+0.4', '', '−1.3', '']);
});
