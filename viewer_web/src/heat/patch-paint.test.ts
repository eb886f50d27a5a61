import { afterEach, expect, test, vi } from 'vitest';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { Building, Paint } from '../scene/building.ts';
import { LIGHT } from '../scene/palette.ts';
import { createStore, type Store } from '../store.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { NOT_ASKED, type PatchValues, TIMES_SEEN } from './layers.ts';
import { PatchPaint } from './patch-paint.ts';
import { withinScope } from './scope.ts';
import type { LayerSource } from './state.ts';

/** What the building was told last, in place of a graphics card. */
class FakeBuilding {
  timesSeen: number[] = [];
  values: number[] | null = null;
  paint: Paint = { mode: 'plain' };
  patches: [number[], number[] | null, number[] | null][] = [];
  setTimesSeen(values: Uint8Array): void {
    this.timesSeen = [...values];
  }
  setValues(values: PatchValues | null): void {
    this.values = values && [...values];
  }
  setPaint(paint: Paint): void {
    this.paint = paint;
  }
  patch(at: ArrayLike<number>, seen: ArrayLike<number> | null, values: ArrayLike<number> | null): void {
    this.patches.push([Array.from(at), seen && Array.from(seen), values && Array.from(values)]);
  }
}

const RANGE = { id: 'range', title: 'Best range', unit: 'm', step: 0.001, none: 65535, better: 'low' as const };
const FILES: Record<string, ArrayLike<number>> = {
  'plan/viewer/layers/range.u16': Uint16Array.of(1000, 2000, 65535),
  'plan/viewer/reason.u8': Uint8Array.of(0, 1, 2),
};
afterEach(() => vi.unstubAllGlobals());

function setUp(scope: Uint8Array | null = null): { store: Store; building: FakeBuilding; paint: PatchPaint } {
  vi.stubGlobal(
    'fetch',
    async (address: string) => new Response(FILES[address] as never, { status: FILES[address] ? 200 : 404 }),
  );
  const loaded = {
    base: '',
    plan: smallPlan(),
    patchSeen: withinScope(Uint8Array.of(1, 2, 0), scope),
    scope,
    layers: {
      schema: 'tlsplan/layers/1',
      n_patches: 3,
      layers: [{ ...RANGE, file: 'layers/range.u16' }],
      reasons: ['covered', 'occluded', 'too noisy'],
    },
    stage: {
      triangles: {
        count: 1,
        squaredEdgesM2: Float32Array.of(1, 2, 1),
        firstPatch: Int32Array.of(0),
        patchDepth: Uint8Array.of(1),
      },
    },
  } as unknown as LoadedPlan;
  const store = createStore();
  store.loaded.value = loaded;
  const building = new FakeBuilding();
  const paint = new PatchPaint(store, loaded, building as unknown as Building, () => undefined);
  paint.setPalette(LIGHT);
  return { store, building, paint };
}

test('what nobody asked for stays so, also in values of the draft and of a preview', async () => {
  const { store, building, paint } = setUp(Uint8Array.of(0, 255, 1));
  await shownBy(store);
  expect([...paint.timesSeen]).toEqual([1, NOT_ASKED, 0]);
  paint.setValues(TIMES_SEEN, Uint8Array.of(2, 2, 2));
  expect(building.timesSeen).toEqual([2, NOT_ASKED, 2]);
  paint.patch([1, 2], [3, 3], TIMES_SEEN, null);
  expect([...paint.timesSeen]).toEqual([2, NOT_ASKED, 3]);
  expect(building.patches.at(-1)).toEqual([[1, 2], [NOT_ASKED, 3], null]);
  store.layerId.value = 'range';
  await expect.poll(() => building.values).not.toBeNull();
  expect(paint.valueAt(1)).toBeNull();
  expect(paint.valueAt(0)?.value).toBe(1000);
});

const shownBy = (store: Store) => expect.poll(() => store.layerState.value.kind).toBe('shown');

test('the layer that the store names is fetched and painted', async () => {
  const { store, building, paint } = setUp();
  await shownBy(store);
  expect(building.values).toBeNull();
  store.layerId.value = 'range';
  await expect.poll(() => building.values).toEqual([1000, 2000, 65535]);
  expect(building.paint).toMatchObject({ mode: 'ramp', low: 0, none: 65535 });
  expect(paint.valueAt(1)).toMatchObject({ value: 2000 });
  expect(paint.valueAt(2)).toBeNull();
  store.layerId.value = 'reason';
  await expect.poll(() => building.values).toEqual([0, 1, 2]);
  expect(building.paint.mode).toBe('classes');
  store.layerId.value = 'plain';
  await expect.poll(() => building.paint.mode).toBe('plain');
});

test('a source goes before the files, for how many see a patch too, and the files come back when it goes', async () => {
  const { store, building } = setUp();
  store.layerId.value = 'range';
  await expect.poll(() => building.values).toEqual([1000, 2000, 65535]);
  const source: LayerSource = async (id) =>
    id === TIMES_SEEN ? Uint8Array.of(3, 3, 3) : id === 'range' ? Uint16Array.of(1, 2, 3) : null;
  store.layerSource.value = source;
  await expect.poll(() => building.values).toEqual([1, 2, 3]);
  expect(building.timesSeen).toEqual([3, 3, 3]);
  store.layerId.value = 'reason';
  await expect.poll(() => building.values).toEqual([0, 1, 2]);
  store.layerSource.value = null;
  await expect.poll(() => building.timesSeen).toEqual([1, 2, 0]);
});

test('changes of patches reach the layer they are of, and no other', async () => {
  const { store, building, paint } = setUp();
  store.layerId.value = 'range';
  await expect.poll(() => building.values).not.toBeNull();
  paint.patch([2], [1], 'range', [1500]);
  paint.patch([0], [4], 'spacing', [9]);
  paint.patch([1], null, 'range', [1700]);
  expect(building.patches).toEqual([
    [[2], [1], [1500]],
    [[0], [4], null],
    [[1], null, [1700]],
  ]);
  expect([...paint.timesSeen]).toEqual([4, 2, 1]);
  expect([0, 1, 2].map((patch) => paint.valueAt(patch)?.value)).toEqual([1000, 1700, 1500]);
});

test('of layers chosen in quick succession the last is shown, whichever answers last', async () => {
  const { store, building } = setUp();
  const answers: (() => void)[] = [];
  store.layerSource.value = (id) =>
    new Promise((resolve) => {
      if (id === TIMES_SEEN) resolve(null);
      else answers.push(() => resolve(id === 'range' ? Uint16Array.of(5, 5, 5) : Uint8Array.of(7, 7, 7)));
    });
  store.layerId.value = 'range';
  await expect.poll(() => answers).toHaveLength(1);
  store.layerId.value = 'reason';
  await expect.poll(() => answers).toHaveLength(2);
  answers[1]();
  await expect.poll(() => building.values).toEqual([7, 7, 7]);
  answers[0]();
  await new Promise((later) => setTimeout(later, 5));
  expect(building.values).toEqual([7, 7, 7]);
});

test('a layer the plan does not have, and one that does not come, are told in words', async () => {
  const { store } = setUp();
  store.layerId.value = 'noise';
  await expect.poll(() => store.layerState.value).toMatchObject({ kind: 'failed' });
  expect(store.layerState.value).toMatchObject({ message: expect.stringMatching(/"noise".*Plan again/) });
  store.layerSource.value = () => Promise.reject(new Error('The server is gone.'));
  store.layerId.value = 'range';
  await expect.poll(() => store.layerState.value).toMatchObject({ message: 'The server is gone.' });
});
