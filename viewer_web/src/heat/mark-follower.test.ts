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
import type { Marking } from './state.ts';

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

/** Patches 1 and 2 of the first requirement, patch 2 and 3 of the second, as viewer/lost has them. */
const LOST = Uint32Array.of(2, 2, 1, 2, 2, 3);
const LIMITS = { spacing_m: 0.01, range_m: null, incidence_rad: null, noise_m: null };
const WALLS = {
  name: 'Walls',
  coverage: 1,
  asked: LIMITS,
  seen_from: 1,
  floors: [],
  classes: [],
  zone: [],
  heights: null,
};

interface OwnMarks {
  readonly required?: Partial<Requirements>;
  readonly timesSeen?: Uint8Array;
  readonly scope?: Uint8Array | null;
  /** The plan tells what is lost with its stations. */
  readonly isTold?: boolean;
  readonly requirement?: string | null;
  /** What the live side says is lost. */
  readonly live?: Uint32Array;
}

/** What is marked as lost with a station which sees all four patches, and the state of that. */
async function ownMarksOf({
  required = {},
  timesSeen = Uint8Array.of(1, 1, 2, 1),
  scope = null,
  isTold = true,
  requirement = null,
  live,
}: OwnMarks): Promise<{ marks: number[]; state: Marking }> {
  serve({ 'plan/viewer/seen/S001.bits': Uint8Array.of(0b1111), 'plan/viewer/lost/S001.u32': LOST.buffer });
  const plan = smallPlan();
  const results = ['overall', 'Walls'].map((name) => ({
    name,
    required: 0.9,
    fraction_of_achievable: 0.95,
    met: true,
  }));
  const stations = plan.stations.map((station) => ({ ...station, losses: isTold ? [] : null }));
  const loaded = {
    base: '',
    plan: { ...plan, stations, requirements: { ...plan.requirements, results, ...required } },
    patchSeen: withinScope(timesSeen, scope),
    scope,
    layers: null,
    stage: {
      offsetM: [0, 0, 0],
      triangles: TRIANGLES,
      elements: [],
      floors: [],
      stations: [{ id: 'S001', floorId: 'F0', order: 1, positionM: [0, 0, 1], cloudUri: 'clouds/S001.u16' }],
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
  if (live !== undefined) {
    const none = async (): Promise<null> => null;
    store.stationSource.value = { seen: none, cloud: none, lost: async () => live.slice().buffer };
  }
  store.stationId.value = 'S001';
  store.showsOwn.value = true;
  store.ownRequirement.value = requirement;
  await vi.waitFor(() => expect(['shown', 'failed']).toContain(store.marking.value.kind));
  follower.dispose();
  paint.dispose();
  return { marks, state: store.marking.value };
}

test('what requirements would lose without a station is marked as the plan tells it, each patch once', async () => {
  const { marks, state } = await ownMarksOf({ required: { asked: LIMITS } });
  expect(marks).toEqual([0, 1, 1, 1]);
  expect(state).toEqual({ kind: 'shown', areaM2: 1.5 });
});

test('of one requirement only what it would lose is marked', async () => {
  const parts = [WALLS];
  expect((await ownMarksOf({ required: { parts }, requirement: 'overall' })).marks).toEqual([0, 1, 1, 0]);
  expect((await ownMarksOf({ required: { parts }, requirement: 'Walls' })).marks).toEqual([0, 0, 1, 1]);
});

test('while stations are edited, the live side tells what would be lost', async () => {
  const live = Uint32Array.of(1, 0, 0);
  expect((await ownMarksOf({ required: { asked: LIMITS }, live })).marks).toEqual([1, 0, 0, 0]);
});

test('of an older plan what only a station sees is marked where it was asked for, and nowhere else', async () => {
  expect((await ownMarksOf({ isTold: false })).marks).toEqual([1, 1, 0, 1]);
  const scope = Uint8Array.of(0, 255, 0, 255);
  expect((await ownMarksOf({ isTold: false, required: { floors: ['F0'] }, scope })).marks).toEqual([1, 0, 0, 0]);
});

test.each([
  ['limits', { asked: LIMITS }],
  ['two stations', { seen_from: 2 }],
  ['limits of a part', { parts: [WALLS] }],
])('an older plan that asks for %s says that it does not tell, rather than guess', async (_, required) => {
  const { marks, state } = await ownMarksOf({ isTold: false, required });
  expect(marks).toEqual([]);
  expect(state).toMatchObject({ kind: 'failed', message: expect.stringContaining('Plan again') });
});

test('a file that does not fit the plan’s requirements is refused', async () => {
  const { state } = await ownMarksOf({ required: { asked: LIMITS }, live: Uint32Array.of(2, 2, 1) });
  expect(state).toMatchObject({ kind: 'failed', message: expect.stringContaining('can’t be read') });
});
