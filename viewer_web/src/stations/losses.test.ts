import { expect, test } from 'vitest';
import { smallPlan } from '../testing/small-plan.ts';
import { asksMore, lossLegend, lossWords, lostM2, parseLost, verdictOf } from './losses.ts';

const LIMITS = { spacing_m: null, range_m: null, incidence_rad: null, noise_m: null };

function planAsking(required: object) {
  const plan = smallPlan();
  return { ...plan, requirements: { ...plan.requirements, ...required } };
}

test.each([
  [{}, false],
  [{ asked: LIMITS, seen_from: 1, parts: [] }, false],
  [{ asked: { ...LIMITS, noise_m: 0.003 } }, true],
  [{ asked: { ...LIMITS, spacing_m: 0.01 } }, true],
  [{ seen_from: 2 }, true],
  [{ parts: [{ name: 'Walls' }] }, true],
])('of what is asked by %j, more than seeing is %s', (required, isMore) => {
  expect(asksMore(planAsking(required))).toBe(isMore);
});

test('only where seeing is all that is asked, a station is said to be the only one that sees', () => {
  const limited = planAsking({ asked: { ...LIMITS, spacing_m: 0.01 } });
  expect(lossWords(smallPlan()).name).toBe('Unique area');
  expect(lossWords(limited).name).toBe('Lost if removed');
  expect(lossLegend(smallPlan(), 'S001', null)).toBe('Unique area of S001');
  expect(lossLegend(limited, 'S001', null)).toBe('Lost without S001');
  expect(lossLegend(limited, 'S001', 'Walls')).toBe('Walls: lost without S001');
});

test('the figure is that of all requirements together where more than seeing is asked and the plan tells it', () => {
  const worth = { covered_area_m2: 9, own_area_m2: 2, lost_area_m2: 5, losses: [] };
  const limited = planAsking({ seen_from: 2 });
  expect(lostM2(smallPlan(), worth)).toBe(2);
  expect(lostM2(limited, worth)).toBe(5);
  expect(lostM2(limited, { ...worth, lost_area_m2: null })).toBe(2);
});

test.each([
  [true, 0.99, true, 'still met: 97.0 %, 95 % required'],
  [false, 0.99, true, 'no longer met: 97.0 %, 95 % required'],
  [false, 0.94, false, 'not met either way: 97.0 %, 95 % required'],
])('met without it: %s, share now %f, met now: %s', (met, fraction, metNow, words) => {
  const loss = { requirement: 'Walls', area_m2: 1, fraction_of_achievable: 0.96999, met };
  expect(verdictOf(loss, { name: 'Walls', required: 0.95, fraction_of_achievable: fraction, met: metNow })).toBe(words);
});

test('patches are read by requirement, also where one of them would lose none', () => {
  const lost = parseLost(Uint32Array.of(2, 0, 1, 7, 9, 4).buffer, 3);
  expect(lost?.map((patches) => [...patches])).toEqual([[7, 9], [], [4]]);
});

test.each([
  ['too short', Uint32Array.of(2, 7).buffer, 1],
  ['too long', Uint32Array.of(1, 7, 9).buffer, 1],
  ['without a number for each', Uint32Array.of(1).buffer, 2],
  ['not of whole numbers', new ArrayBuffer(7), 1],
])('a file %s is none', (_, bytes, nRequirements) => {
  expect(parseLost(bytes, nRequirements)).toBeNull();
});
