import { expect, test } from 'vitest';
import { planTotals } from '../edit/totals.ts';
import { missedInWords } from '../panels/requirements.tsx';
import { shortfallsOf } from '../shortfalls/shortfalls.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { figureRows, hasSameDoors, steepestCurve, titleOfBase } from './comparison.ts';

const NO_LIMITS = { spacing_m: null, range_m: null, incidence_rad: null, noise_m: null };

test('plans are named by the run that made them', () => {
  expect(['', 'runs/R002/plan', 'old'].map(titleOfBase)).toEqual(['The plan', 'Run R002', 'old']);
});

test('plans with other doors open are of other surfaces', () => {
  const plan = smallPlan();
  const options = { metres_per_unit: null, up_axis: null, skip_bad_faces: false, glass: 'stop' as const };
  const withDoors = (open: string[], shut: string[], doors: 'open' | 'shut' = 'shut') => ({
    ...plan,
    scene: {
      ...plan.scene,
      doors,
      load_options: { ...options, doors, doors_open: open, doors_shut: shut, leave_out: [] },
    },
  });
  expect(hasSameDoors(plan, withDoors([], []))).toBe(true);
  expect(hasSameDoors(withDoors(['a', 'b'], ['c']), withDoors(['b', 'a'], ['c']))).toBe(true);
  expect(hasSameDoors(withDoors(['a'], []), withDoors([], ['a']))).toBe(false);
  expect(hasSameDoors(withDoors([], [], 'open'), withDoors([], []))).toBe(false);
});

test('figures stand side by side, floor by floor', () => {
  const plan = smallPlan();
  const other = { ...planTotals(plan), nStations: 4, floors: planTotals(plan).floors.slice(0, 1) };
  expect(figureRows(planTotals(plan), { ...other, floors: planTotals(plan).floors })).toEqual([
    { name: 'Stations', shown: '3', other: '4' },
    { name: 'Coverage', shown: '95.0 %', other: '95.0 %' },
    { name: 'Ground floor', shown: '95.0 %', other: '95.0 %' },
    { name: 'Upper floor', shown: '95.0 %', other: '95.0 %' },
    { name: 'Links', shown: '1', other: '1' },
    { name: 'Connected groups', shown: '3', other: '3' },
  ]);
});

test('one coverage reads the same in the headline, by floor, in what is not met and in the comparison', () => {
  const plan = smallPlan();
  // Just short: rounded it would read as enough.
  const figures = { ...plan.coverage, fraction_of_achievable: 0.94996 };
  const short = {
    ...plan,
    coverage: { ...figures, floors: plan.coverage.floors.map(({ floor }) => ({ ...figures, floor })) },
    requirements: {
      ...plan.requirements,
      results: [
        { ...figures, name: 'overall', required: 0.95, seen_from: 1, asked: NO_LIMITS, met: false, as_set_up: null },
      ],
    },
  };
  const totals = planTotals(short);
  const rows = figureRows(totals, totals).filter(({ name }) => /Coverage|floor/.test(name));
  expect(rows.map(({ shown }) => shown)).toEqual(Array(3).fill('just below 95 %'));
  expect(missedInWords(totals.requirements)).toBe('whole building just below 95 % of 95 %');
  expect(shortfallsOf(short, totals)[0].words).toContain('just below 95 % of 95 %');
});

test('of plans of different floors nothing is set beside that is not of the same floor', () => {
  const plan = smallPlan();
  const other = { ...planTotals(plan), nStations: 2, floors: planTotals(plan).floors.slice(0, 1) };
  expect(figureRows(planTotals(plan), other).slice(0, 5)).toEqual([
    { name: 'Stations', shown: '3', other: '2' },
    { name: '– Ground floor', shown: '2', other: '2' },
    { name: '– Upper floor', shown: '1', other: 'not planned' },
    { name: 'Coverage, Ground floor', shown: '95.0 %', other: '95.0 %' },
    { name: 'Coverage, Upper floor', shown: '95.0 %', other: 'not planned' },
  ]);
});

test('a floor that only the other plan has is told too', () => {
  const plan = smallPlan();
  const shown = { ...planTotals(plan), floors: planTotals(plan).floors.slice(0, 1) };
  expect(figureRows(shown, planTotals(plan)).map(({ name }) => name)).toContain('Coverage, Upper floor');
});

test('curves begin with the station that adds most, where the plan says which that is', () => {
  const plan = { ...smallPlan(), coverage_curve: [0.2, 0.9] };
  expect(steepestCurve(plan)).toEqual([0.2, 0.9]);
  const step = (station: string, fraction_of_achievable: number) => ({
    station,
    covered_area_m2: 1,
    fraction_of_achievable,
  });
  const why = {
    stations: [],
    curve: [step('S002', 0.7), step('S001', 0.9)],
    area_by_reason_m2: {},
    unlisted_area_m2: {},
    unseen_surfaces: [],
  };
  expect(steepestCurve({ ...plan, why })).toEqual([0.7, 0.9]);
});
