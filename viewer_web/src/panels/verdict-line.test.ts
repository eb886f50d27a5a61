import { expect, test } from 'vitest';
import { planTotals } from '../edit/totals.ts';
import { resultOf, smallPlan } from '../testing/small-plan.ts';
import { partsOf } from './verdict-line.tsx';

const met = (name: string, fraction: number) =>
  resultOf({ name, required: 0.95, fraction_of_achievable: fraction, met: fraction >= 0.95 });

test('the verdict names coverage, floors, zones and the network, each with whether it is met', () => {
  const plan = smallPlan();
  plan.coverage.floors[1].fraction_of_achievable = 0.9499;
  plan.requirements.network = 'connected';
  plan.requirements.results = [
    met('Ground floor', 0.96),
    met('Upper floor', 0.9499),
    met('stairs', 0.99),
    met('overall', 0.95),
  ];
  expect(partsOf(planTotals(plan))).toEqual([
    { words: '95.0 %', isMet: true },
    { words: '1 of 2 floors', isMet: false },
    { words: '1 of 1 zones and classes', isMet: true },
    { words: '3 groups', isMet: false },
  ]);
});

test('a plan of which no network is required has no word on it', () => {
  const plan = smallPlan();
  plan.requirements.network = 'none';
  expect(partsOf(planTotals(plan)).map(({ words }) => words)).toEqual(['95.0 %', '2 of 2 floors']);
});
