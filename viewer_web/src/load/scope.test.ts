import { afterEach, expect, test, vi } from 'vitest';
import { smallPlan } from '../testing/small-plan.ts';
import { fetchScope } from './fetch-plan.ts';
import type { PlanJson } from './plan-json.ts';

afterEach(() => vi.unstubAllGlobals());

function scopeOf(
  floors: string[],
  reasons: Uint8Array<ArrayBuffer> | null,
  scope: PlanJson['scope'] = null,
): Promise<Uint8Array | null> {
  vi.stubGlobal('fetch', async (address: string) => {
    expect(address).toBe('plan/runs/R001/plan/viewer/reason.u8');
    return reasons === null ? new Response('', { status: 404 }) : new Response(reasons);
  });
  const plan = smallPlan();
  return fetchScope('runs/R001/plan', { ...plan, requirements: { ...plan.requirements, floors }, scope }, 4);
}
const SOME = Uint8Array.of(0, 255, 9, 255);

test('a plan of some floors tells by its reasons what it is of', async () => {
  expect(await scopeOf(['F0'], SOME)).toEqual(SOME);
});

test('a plan of all floors, named or not, and one of an older version are of everything', async () => {
  expect(await scopeOf([], SOME)).toBeNull();
  expect(await scopeOf(['F0', 'F1'], Uint8Array.of(0, 1, 9, 0))).toBeNull();
  expect(await scopeOf(['F0'], null)).toBeNull();
});

test('surface out of scope, and obstacles, need not be covered', async () => {
  const scope = { kind: 'all', in_scope_area_m2: 90, out_of_scope_area_m2: 0, obstacles: [], left_out: [] } as const;
  const own = { ...scope, obstacles: [], left_out: [] };
  const obstacle = { name: 'IfcFurnishingElement', area_m2: 3 };
  expect(await scopeOf([], SOME, { ...own, obstacles: [obstacle] })).toEqual(SOME);
  expect(await scopeOf([], SOME, { ...own, kind: 'interior', out_of_scope_area_m2: 7 })).toEqual(SOME);
  expect(await scopeOf([], SOME, { ...own, obstacles: [{ ...obstacle, area_m2: 0 }] })).toBeNull();
});

test('reasons of another number of patches are refused', async () => {
  await expect(scopeOf(['F0'], Uint8Array.of(0, 255))).rejects.toThrow(/reason.u8: 2 bytes, expected 4/);
});
