import { expect, test } from 'vitest';
import { smallPlan } from '../testing/small-plan.ts';
import { parsePlan } from './plan-json.ts';

test('a plan that fits is taken, with keys the viewer does not know left out of sight', () => {
  const plan = parsePlan({ ...smallPlan(), future: { anything: 1 } });
  expect(plan.stations.map((station) => station.id)).toEqual(['S001', 'S002', 'S003']);
});

test('an error names the key, what it is, what was expected, and the remedy', () => {
  const plan = smallPlan();
  (plan.stations[1] as { position: unknown }).position = [1, 'two', 3];
  expect(() => parsePlan(plan)).toThrow(/stations\.1\.position\.1 is "two", expected number.*tlsplan plan/);
});

test('a plan of another schema is told by its schema', () => {
  expect(() => parsePlan({ ...smallPlan(), schema: 'tlsplan/plan/9' })).toThrow(/tlsplan\/plan\/9.*this version/);
});

test('what is no plan at all is told', () => {
  expect(() => parsePlan(null)).toThrow(/plan\.json/);
});

test('a plan of the first version is taken, with what it did not say filled in', () => {
  const plan = smallPlan(); // made of the keys that every version writes
  expect([plan.route, plan.why, plan.site.settled, plan.requirements.results]).toEqual([null, null, [], []]);
  expect(plan.registration.links[1]?.weak_axis).toBe('');
  expect(plan.requirements.network).toBe('none');
});
