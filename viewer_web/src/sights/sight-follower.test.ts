import { signal } from '@preact/signals';
import { expect, test, vi } from 'vitest';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { Picked } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { SightFollower } from './sight-follower.ts';
import { createSightState } from './state.ts';

const PATCH = 9;

/** Of a wall of ten patches in the plane y = 0, clicked at the origin: its sights, by rows of bits that stations have. */
async function sightsWith(incidence_rad: number | null, bits: Readonly<Record<string, readonly number[]>>) {
  const { sights } = createSightState();
  const placesM: Record<string, number[]> = { S001: [0, 4, 0], S002: [4, 1, 0], S003: [0, 3, 0] };
  const store = {
    picked: signal({ pointM: [0, 0, 0], patch: PATCH, triangle: 0, isSection: false } as unknown as Picked),
    shownStations: signal(Object.entries(placesM).map(([id, positionM]) => ({ id, positionM }))),
    stationSource: signal({ seen: async (id: string) => Uint8Array.from(bits[id]) }),
    sights,
  } as unknown as Store;
  const loaded = {
    stage: {
      offsetM: [0, 0, 0],
      triangles: { squaredEdgesM2: Float32Array.of(1, 1, 2), cornersM: Float32Array.of(0, 0, 0, 1, 0, 0, 0, 0, 1) },
    },
    plan: {
      scanner: { range_max_m: 20 },
      requirements: { asked: { spacing_m: null, range_m: null, incidence_rad, noise_m: null } },
    },
    patchSeen: new Uint8Array(PATCH + 1),
  } as unknown as LoadedPlan;
  const follower = new SightFollower(store, loaded);
  await vi.waitFor(() => expect(sights.value.kind).toBe('shown'));
  follower.dispose();
  return sights.value.kind === 'shown' ? sights.value.sights.map((one) => [one.stationId, one.shortfall]) : [];
}

test('of the stations that see a surface, those beyond the limits are named with the limit, as they are not counted', async () => {
  // Bit 9 of the first row of two bytes: it sees the patch. Of the second row: it does so within the limits.
  const bits = { S001: [0, 2, 0, 2], S002: [0, 2, 0, 0], S003: [0, 0, 0, 0] };
  expect(await sightsWith(1, bits)).toEqual([
    ['S001', null],
    ['S002', 'too oblique'],
  ]);
});

test('without limits there is one row of bits, and who sees a surface is counted', async () => {
  const bits = { S001: [0, 2], S002: [0, 2], S003: [0, 0] };
  expect(await sightsWith(null, bits)).toEqual([
    ['S001', null],
    ['S002', null],
  ]);
});
