import { expect, test } from 'vitest';
import { planTotals } from '../edit/totals.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { shortfallsOf } from './shortfalls.ts';

const joined = (): PlanJson => {
  const plan = smallPlan();
  return { ...plan, requirements: { ...plan.requirements, network: 'connected' } };
};
const sealed = [
  { floor: 'F0', area_m2: 34.25, inside: [1001, 2001, 0] as [number, number, number], rectangles: [] },
  { floor: 'F1', area_m2: 1062, inside: [1002, 2002, 2.8] as [number, number, number], rectangles: [] },
];

test('what is not planned comes first, then what is not met, then what does not register', () => {
  const plan = { ...joined(), sealed };
  const totals = planTotals(plan);
  const [first] = totals.requirements;
  const short = { ...totals, requirements: [{ ...first, name: 'Upper floor', coverage: 0.931, isMet: false }] };
  const found = shortfallsOf(plan, short);
  expect(found.map(({ words }) => words)).toEqual([
    'Not planned: 1,096.3 m² of floor that can’t be reached on foot, in 2 areas',
    'Not met: Upper floor 93.1 % of 95 %',
    '3 unconnected groups',
  ]);
  // Largest first.
  expect(found[0]).toMatchObject({ places: [{ floorId: 'F1' }, { floorId: 'F0' }] });
  expect(totals.unreachableM2).toBeCloseTo(1096.25);
});

test('surface in scope that no position sees stands beside the coverage from a third on, never where all is in scope', () => {
  const plan = joined();
  const totals = { ...planTotals(plan), requirements: [], nNetworks: 1 };
  const words = (kind: 'interior' | 'all', achievable_area_m2: number): string[] => {
    const scope = { kind, in_scope_area_m2: 448, out_of_scope_area_m2: 9, obstacles: [], left_out: [] };
    const coverage = { ...plan.coverage, achievable_area_m2, total_area_m2: 448 };
    return shortfallsOf({ ...plan, scope, coverage, sealed: [] }, totals).map((each) => each.words);
  };
  expect(words('interior', 268)).toEqual([
    'Not scannable: 180.0 m² of 448.0 m² in scope, from no valid tripod position',
  ]);
  expect(words('interior', 300)).toEqual([]);
  expect(words('all', 268)).toEqual([]);
});

test('surface that is seen but not as required stands beside the coverage from a tenth of what counts on', () => {
  const plan = joined();
  const totals = { ...planTotals(plan), requirements: [], nNetworks: 1 };
  const words = (oblique: number): string[] => {
    const area_by_reason_m2 = { covered: 110, 'too oblique': oblique, 'too sparse': 5, occluded: 300 };
    const why = { stations: [], curve: [], area_by_reason_m2, unlisted_area_m2: {}, unseen_surfaces: [] };
    const coverage = { ...plan.coverage, achievable_area_m2: 118, total_area_m2: 539 };
    return shortfallsOf({ ...plan, scope: null, why, coverage, sealed: [] }, totals).map((each) => each.words);
  };
  expect(words(124)).toEqual([
    'Not scannable as required: 129.0 m² that valid positions see, beside the 118.0 m² that count',
  ]);
  expect(words(6)).toEqual([]);
});

test('a plan that keeps all that is required falls short of nothing, and groups count only where they are to be joined', () => {
  const plan = joined();
  const totals = planTotals(plan);
  expect(shortfallsOf(plan, { ...totals, nNetworks: 1 })).toEqual([]);
  const none = { ...plan, requirements: { ...plan.requirements, network: 'none' as const } };
  expect(shortfallsOf(none, totals)).toEqual([]);
  const noOverlap = { ...plan, requirements: { ...plan.requirements, overlap: 0 } };
  expect(shortfallsOf(noOverlap, totals)).toEqual([]);
});

test('groups fall short where links need a probability alone, and not where they need nothing', () => {
  const words = (overlap: number, min_probability: number): string[] => {
    const plan = joined();
    const requirements = { ...plan.requirements, overlap, min_probability };
    const totals = { ...planTotals(plan), requirements: [], nNetworks: 3 };
    return shortfallsOf({ ...plan, requirements, sealed: [] }, totals).map((each) => each.words);
  };
  expect([words(0, 0.99), words(0.3, 0), words(0, 0)]).toEqual([
    ['3 unconnected groups'],
    ['3 unconnected groups'],
    [],
  ]);
});
