import { afterEach, expect, test, vi } from 'vitest';
import { smallPlan } from '../testing/small-plan.ts';
import { fetchScope } from './fetch-plan.ts';

afterEach(() => vi.unstubAllGlobals());

function scopeOf(floors: string[], reasons: Uint8Array<ArrayBuffer> | null): Promise<Uint8Array | null> {
  vi.stubGlobal('fetch', async (address: string) => {
    expect(address).toBe('plan/runs/R001/plan/viewer/reason.u8');
    return reasons === null ? new Response('', { status: 404 }) : new Response(reasons);
  });
  const plan = smallPlan();
  return fetchScope('runs/R001/plan', { ...plan, requirements: { ...plan.requirements, floors } }, 4);
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

test('reasons of another number of patches are refused', async () => {
  await expect(scopeOf(['F0'], Uint8Array.of(0, 255))).rejects.toThrow(/reason.u8: 2 bytes, expected 4/);
});
