import { expect, test } from 'vitest';
import { OWN_PLAN, planBaseOf, planUrl } from './plan-base.ts';

test('files of the own plan and of another plan are asked for beside the page', () => {
  expect(planUrl(OWN_PLAN, 'plan.json')).toBe('plan/plan.json');
  expect(planUrl('runs/R001/plan', 'viewer/stage.usdc')).toBe('plan/runs/R001/plan/viewer/stage.usdc');
});

test.each([null, '', '../x', '/etc', 'runs//x', 'runs/../x', 'http://elsewhere', 'a\\b', '.hidden', 'runs/R001/'])(
  'an address that names no folder below (%s) means the own plan',
  (named) => {
    expect(planBaseOf(named)).toBe(OWN_PLAN);
  },
);

test('a folder below is taken as named', () => {
  expect(planBaseOf('runs/R001/plan')).toBe('runs/R001/plan');
});
