import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { StageStation } from '../load/stage.ts';
import { createStore, type Store } from '../store.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { CloudSet } from './cloud-set.ts';

const [ROWS, COLUMNS] = [4, 6];
let asked: string[];
let open: (() => void)[];
let isHeld: boolean;
beforeEach(() => {
  asked = [];
  open = [];
  isHeld = false;
  vi.stubGlobal('window', { devicePixelRatio: 1 });
  vi.stubGlobal('fetch', (address: string, { signal }: { signal: AbortSignal }) => {
    asked.push(address);
    return new Promise<Response>((resolve, reject) => {
      signal.addEventListener('abort', () => reject(new Error('aborted')));
      const answer = (): void =>
        resolve(
          address.includes('S003')
            ? new Response('gone', { status: 404 })
            : new Response(new Uint8Array(3 * ROWS * COLUMNS).fill(1)),
        );
      if (isHeld) open.push(answer);
      else answer();
    });
  });
});
afterEach(() => vi.unstubAllGlobals());

function setUp(): { store: Store; clouds: CloudSet } {
  const plan = smallPlan();
  const stations: StageStation[] = plan.stations.map(({ id, floor, order }) => ({
    id,
    floorId: floor,
    order,
    positionM: [0, 0, 1],
    cloudUri: `clouds/${id}.u16`,
    cloudRows: ROWS,
    cloudColumns: COLUMNS,
    rangeStepM: 0.01,
    elevationsRad: new Float32Array(ROWS),
    azimuthsRad: new Float32Array(ROWS),
    azimuthStepRad: 1,
  }));
  const floors = plan.floors.map(({ id, name }, index) => ({
    id,
    name,
    index,
    elevationM: 3 * index,
    topM: 3 * index + 3,
  }));
  const loaded = { base: '', plan, stage: { floors, stations, offsetM: [0, 0, 0] } } as unknown as LoadedPlan;
  const store = createStore();
  store.loaded.value = loaded;
  const whole = { minM: [0, 0, 0] as const, maxM: [10, 8, 6] as const };
  store.extents.value = { whole, grounds: new Map() } as never;
  return { store, clouds: new CloudSet(store, loaded, () => undefined) };
}
/** A cloud whose first column has steps of 0x0202, the next 0x0202 more. */
const packed = (): Promise<ArrayBuffer> =>
  new Response(
    new Blob([new Uint8Array(3 * ROWS * COLUMNS).fill(2)]).stream().pipeThrough(new CompressionStream('deflate')),
  ).arrayBuffer();
const kind = (store: Store) => store.cloud.value.kind;

test('the chosen station’s cloud is shown, and gone when the choice goes', async () => {
  const { store, clouds } = setUp();
  expect(kind(store)).toBe('none');
  store.chooseStation('S001');
  expect(store.cloud.value).toMatchObject({ kind: 'loading', n: 0, of: 1 });
  await expect.poll(() => kind(store)).toBe('shown');
  expect(store.cloud.value).toMatchObject({
    nStations: 1,
    nReturns: ROWS * COLUMNS,
    nBeams: ROWS * COLUMNS,
    nScanned: 720,
  });
  expect(store.chosenCloud.value?.stationId).toBe('S001');
  const [points] = clouds.group.children;
  const disposed = vi.spyOn((points as unknown as { geometry: { dispose(): void } }).geometry, 'dispose');
  store.chooseStation(null);
  expect(clouds.group.children).toHaveLength(0);
  expect(disposed).toHaveBeenCalledOnce();
  expect([kind(store), store.chosenCloud.value]).toEqual(['none', null]);
});

test('all clouds are those of the floor that is shown; what stays is not asked for again', async () => {
  const { store, clouds } = setUp();
  store.chooseFloor('F0');
  store.showClouds.value = true;
  await expect.poll(() => store.cloud.value).toMatchObject({ kind: 'shown', nStations: 2 });
  expect(asked).toEqual(['plan/viewer/clouds/S001.u16', 'plan/viewer/clouds/S002.u16']);
  store.chooseStation('S002');
  expect(store.chosenCloud.value?.stationId).toBe('S002');
  expect(asked).toHaveLength(2);
  store.showClouds.value = false;
  expect(clouds.group.children).toHaveLength(1);
  expect(asked).toHaveLength(2);
});

test('a cloud that is switched off gives its memory back, and its station’s returns are counted no more', async () => {
  const { store, clouds } = setUp();
  store.chooseFloor('F0');
  store.showClouds.value = true;
  await expect.poll(() => store.cloud.value).toMatchObject({ kind: 'shown', nStations: 2 });
  store.hiddenClouds.value = new Set(['S001']);
  expect(store.cloud.value).toMatchObject({ kind: 'shown', nStations: 1, nScanned: 720 });
  expect(clouds.group.children).toHaveLength(1);
  // Chosen, it is shown all the same: its card is about it.
  store.chooseStation('S001');
  await expect.poll(() => store.cloud.value).toMatchObject({ kind: 'shown', nStations: 2 });
  store.chooseStation(null);
  store.hiddenClouds.value = new Set(['S001', 'S002']);
  expect(kind(store)).toBe('none');
});

test('clouds of all stations are told apart by colour unless another is chosen', () => {
  const { store } = setUp();
  expect(store.cloudPaint.value).toBe('range');
  store.showClouds.value = true;
  expect(store.cloudPaint.value).toBe('station');
  store.chosenPaint.value = 'intensity';
  expect(store.cloudPaint.value).toBe('intensity');
});

test('what is let go of while it is on its way never shows', async () => {
  isHeld = true;
  const { store, clouds } = setUp();
  store.chooseStation('S001');
  await expect.poll(() => open).toHaveLength(1);
  store.chooseStation('S002');
  await expect.poll(() => open).toHaveLength(2);
  for (const answer of open) answer();
  await expect.poll(() => kind(store)).toBe('shown');
  expect(store.chosenCloud.value?.stationId).toBe('S002');
  expect(clouds.group.children).toHaveLength(1);
  clouds.dispose();
  expect(clouds.group.children).toHaveLength(0);
});

test('a cloud that is missing is told, and another choice shows again', async () => {
  const { store } = setUp();
  store.chooseStation('S003');
  await expect.poll(() => kind(store)).toBe('failed');
  expect(store.cloud.value).toMatchObject({ message: expect.stringMatching(/S003\.u16.*404/) });
  store.chooseStation('S001');
  await expect.poll(() => kind(store)).toBe('shown');
});

test('a station of the draft alone has the cloud that the live side gives', async () => {
  const { store } = setUp();
  const added = {
    id: 'N1',
    floorId: 'F0',
    number: 9,
    order: 9,
    positionM: [1, 1, 1] as const,
    marks: ['added' as const],
  };
  store.draft.value = { stations: [...store.shownStations.value, added], links: [] };
  store.stationSource.value = {
    seen: async () => null,
    lost: async () => null,
    cloud: async (id) => (id === 'N1' ? packed() : null),
  };
  store.chooseStation('N1');
  await expect.poll(() => kind(store)).toBe('shown');
  expect([...(store.chosenCloud.value?.cloud.rangeSteps ?? [])].slice(0, 2)).toEqual([0x0202, 0x0404]);
  expect(asked).toEqual([]);
});
