import { afterEach, expect, test, vi } from 'vitest';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { UnseenSurface } from '../load/plan-json.ts';
import type { Building } from '../scene/building.ts';
import { PatchPlaces } from '../scene/patch-places.ts';
import { createStore } from '../store.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { LEFT_BY_EDITS } from './layers.ts';
import { MarkFollower } from './mark-follower.ts';
import { PatchPaint } from './patch-paint.ts';
import { withinScope } from './scope.ts';

/** Four triangles of one patch each, side by side, 0.5 m² each: one element. */
const CORNERS_M = Float32Array.from([0, 1, 2, 3].flatMap((x) => [x, 0, 0, x + 1, 0, 0, x, 1, 0]));
const TRIANGLES = {
  count: 4,
  cornersM: CORNERS_M,
  squaredEdgesM2: Float32Array.from([0, 1, 2, 3].flatMap(() => [1, 2, 1])),
  firstPatch: Int32Array.of(0, 1, 2, 3),
  patchDepth: new Uint8Array(4),
};
/** A piece of patches 0 and 1, as another room of the same element has patch 2 in its box. */
const SURFACE = {
  element: 7,
  name: 'Slab',
  floor: 'F0',
  reason: 'occluded',
  area_m2: 1,
  pieces: [
    {
      area_m2: 1,
      centroid: [1, 0.3, 0],
      box: [
        [0, 0, 0],
        [3, 1, 0],
      ],
      patch: 1,
    },
  ],
} as unknown as UnseenSurface;
afterEach(() => vi.unstubAllGlobals());

/** What requests for files are answered with. */
function serve(files: Record<string, BodyInit>): void {
  vi.stubGlobal('fetch', async (address: string) => new Response(files[address] ?? null, { status: 200 }));
}

async function marksOf(surface: UnseenSurface, pieces: string | null): Promise<{ marks: number[]; areaM2: number }> {
  serve({
    'plan/viewer/pieces.i32': Int32Array.of(1, 1, -1, -1).buffer,
    'plan/viewer/reason.u8': Uint8Array.of(1, 1, 1, 0),
  });
  const element = { sceneIndex: 7, name: 'Slab', kind: '', floorId: 'F0', firstTriangle: 0, nTriangles: 4 };
  const loaded = {
    base: '',
    plan: smallPlan(),
    patchSeen: Uint8Array.of(0, 0, 0, 1),
    scope: null,
    layers: { reasons: ['covered', 'occluded'], layers: [], pieces },
    stage: { elements: [element], offsetM: [0, 0, 0], triangles: TRIANGLES, stations: [] },
  } as unknown as LoadedPlan;
  const store = createStore();
  store.loaded.value = loaded;
  let marks: number[] = [];
  const building = { setMarks: (values: Uint8Array | null) => (marks = [...(values ?? [])]) } as unknown as Building;
  const paint = { timesSeen: Uint8Array.of(0, 1, 0, 1), areas: new Float32Array(4).fill(0.5) } as unknown as PatchPaint;
  const places = new PatchPlaces(TRIANGLES as never);
  const follower = new MarkFollower(
    store,
    loaded,
    building,
    paint,
    () => places,
    () => undefined,
  );
  store.unseenFocus.value = { surface, piece: 0 };
  await vi.waitFor(() => expect(store.marking.value.kind).toBe('shown'));
  follower.dispose();
  return { marks, areaM2: (store.marking.value as { areaM2: number }).areaM2 };
}

test('a piece is marked as the plan tells it, with the figure of the list', async () => {
  expect(await marksOf(SURFACE, 'pieces.i32')).toEqual({ marks: [1, 1, 0, 0], areaM2: 1 });
});

test('of an older plan what is unseen alike in the box is marked, and the figure stays that of the list', async () => {
  expect(await marksOf(SURFACE, null)).toEqual({ marks: [1, 1, 1, 0], areaM2: 1 });
});

test('of the edited plan those are marked that its stations do not see', async () => {
  const left = { ...SURFACE, reason: LEFT_BY_EDITS };
  expect(await marksOf(left, 'pieces.i32')).toEqual({ marks: [1, 0, 1, 0], areaM2: 1 });
});

type Requirements = LoadedPlan['plan']['requirements'];

/** Patches that are marked as a station's own, which sees all four, once each: it stands 1 m above the middle of the first. */
async function ownMarksOf(
  required: Partial<Requirements>,
  timesSeen: Uint8Array,
  scope: Uint8Array | null = null,
): Promise<number[]> {
  serve({ 'plan/viewer/seen/S001.bits': Uint8Array.of(0b1111) });
  const plan = smallPlan();
  const positionM = [1 / 3, 1 / 3, 1];
  const loaded = {
    base: '',
    plan: { ...plan, requirements: { ...plan.requirements, ...required } },
    patchSeen: withinScope(timesSeen, scope),
    scope,
    layers: null,
    stage: {
      offsetM: [0, 0, 0],
      triangles: TRIANGLES,
      elements: [],
      floors: [],
      stations: [{ id: 'S001', floorId: 'F0', order: 1, positionM, cloudUri: 'clouds/S001.u16' }],
    },
  } as unknown as LoadedPlan;
  const store = createStore();
  let marks: number[] = [];
  const nothing = (): void => undefined;
  const building = {
    setMarks: (values: Uint8Array | null) => (marks = [...(values ?? [])]),
    setTimesSeen: nothing,
    setValues: nothing,
    setPaint: nothing,
  } as unknown as Building;
  store.loaded.value = loaded;
  const paint = new PatchPaint(store, loaded, building, nothing);
  const follower = new MarkFollower(store, loaded, building, paint, () => new PatchPlaces(TRIANGLES as never), nothing);
  store.stationId.value = 'S001';
  store.showsOwn.value = true;
  await vi.waitFor(() => expect(store.marking.value.kind).toBe('shown'));
  follower.dispose();
  paint.dispose();
  return marks;
}

test('what only a station sees is marked where it was asked for, and nowhere else', async () => {
  const seenOnce = Uint8Array.of(1, 1, 2, 1);
  expect(await ownMarksOf({}, seenOnce)).toEqual([1, 1, 0, 1]);
  expect(await ownMarksOf({ floors: ['F0'] }, seenOnce, Uint8Array.of(0, 255, 0, 255))).toEqual([1, 0, 0, 0]);
});

test('where two stations are asked for, what two see needs each of them', async () => {
  expect(await ownMarksOf({ seen_from: 2 }, Uint8Array.of(1, 2, 3, 2))).toEqual([0, 1, 0, 1]);
});

test('what a station sees from too far or too obliquely is not its own: another sees it as asked', async () => {
  const asked = { spacing_m: null, range_m: null, incidence_rad: null, noise_m: null };
  const once = Uint8Array.of(1, 1, 1, 1);
  // The patches' middles are 0, 1, 2 and 3 m aside.
  expect(await ownMarksOf({ asked: { ...asked, range_m: 2.3 } }, once)).toEqual([1, 1, 1, 0]);
  expect(await ownMarksOf({ asked: { ...asked, incidence_rad: (50 * Math.PI) / 180 } }, once)).toEqual([1, 1, 0, 0]);
});
