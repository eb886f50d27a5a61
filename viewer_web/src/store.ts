/** The one store: what is loaded, what is shown, what is chosen. The panels and the 3D side read the same signals. */
import { batch, computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import { DEFAULT_CUT_M, type extentsOf, floorBeside, type Slice, slicesOf } from './floors/cut.ts';
import type { LoadedPlan } from './load/fetch-plan.ts';
import type { StageElement } from './load/stage.ts';

export type Paint = 'coverage' | 'plain';
export type CloudPaint = 'range' | 'intensity';

export type Phase =
  | { readonly kind: 'loading'; readonly step: string; readonly fraction: number | null }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'ready' };

export type CloudState =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading' }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly nReturns: number };

export type Extents = ReturnType<typeof extentsOf>;

/** A surface that was clicked. */
export interface Picked {
  readonly element: StageElement;
  readonly elementIndex: number;
  /** The floor whose ground it is; null: not ground. */
  readonly groundOf: string | null;
  /** Stations that see the patch under the pointer; null: not achievable, or not a surface but a cut. */
  readonly timesSeen: number | null;
  /** The inside of a body that the cut opens. */
  readonly isSection: boolean;
  /** Scene coordinates, metres. */
  readonly pointM: readonly [number, number, number];
}

export interface Store {
  readonly phase: Signal<Phase>;
  readonly loaded: Signal<LoadedPlan | null>;
  readonly extents: Signal<Extents | null>;
  readonly floorId: Signal<string | null>;
  readonly isSpread: Signal<boolean>;
  readonly cutM: Signal<number>;
  readonly slices: ReadonlySignal<readonly Slice[]>;
  readonly paint: Signal<Paint>;
  readonly showLinks: Signal<boolean>;
  readonly stationId: Signal<string | null>;
  readonly cloud: Signal<CloudState>;
  readonly cloudPaint: Signal<CloudPaint>;
  readonly picked: Signal<Picked | null>;
  readonly isSidebarOpen: Signal<boolean>;
  chooseFloor(floorId: string | null): void;
  stepFloor(step: number): void;
  chooseStation(stationId: string | null): void;
  stepStation(step: number): void;
  pick(picked: Picked | null): void;
  clear(): void;
}

export function createStore(): Store {
  const phase = signal<Phase>({ kind: 'loading', step: 'Reading the plan', fraction: null });
  const loaded = signal<LoadedPlan | null>(null);
  const extents = signal<Extents | null>(null);
  const floorId = signal<string | null>(null);
  const isSpread = signal(true);
  const cutM = signal(DEFAULT_CUT_M);
  const stationId = signal<string | null>(null);
  const picked = signal<Picked | null>(null);
  const slices = computed<readonly Slice[]>(() => {
    const [plan, boxes] = [loaded.value, extents.value];
    if (plan === null || boxes === null) return [];
    const view = { floorId: floorId.value, isSpread: isSpread.value, cutM: cutM.value };
    return slicesOf(view, plan.stage.floors, boxes.whole);
  });

  const chooseFloor = (id: string | null): void =>
    batch(() => {
      floorId.value = id;
      const station = loaded.value?.plan.stations.find(({ id }) => id === stationId.value);
      if (id !== null && station !== undefined && station.floor !== id) stationId.value = null;
      picked.value = null;
    });
  const chooseStation = (id: string | null): void =>
    batch(() => {
      stationId.value = id;
      picked.value = null;
      const station = loaded.value?.plan.stations.find((candidate) => candidate.id === id);
      // Its floor alone: among spread floors the one above would hide it.
      if (station !== undefined) floorId.value = station.floor;
    });
  const stepStation = (step: number): void => {
    const stations = loaded.value?.plan.stations ?? [];
    const shown = floorId.value === null ? stations : stations.filter(({ floor }) => floor === floorId.value);
    if (shown.length === 0) return;
    const at = shown.findIndex(({ id }) => id === stationId.value);
    const next = at < 0 ? (step > 0 ? 0 : shown.length - 1) : (at + step + shown.length) % shown.length;
    chooseStation(shown[next].id);
  };

  return {
    phase,
    loaded,
    extents,
    floorId,
    isSpread,
    cutM,
    slices,
    paint: signal<Paint>('coverage'),
    showLinks: signal(false),
    stationId,
    cloud: signal<CloudState>({ kind: 'none' }),
    cloudPaint: signal<CloudPaint>('range'),
    picked,
    isSidebarOpen: signal(true),
    chooseFloor,
    stepFloor: (step) => chooseFloor(floorBeside(floorId.value, step, loaded.value?.stage.floors ?? [])),
    chooseStation,
    stepStation,
    pick: (surface) => {
      picked.value = surface;
    },
    clear: () =>
      batch(() => {
        if (picked.value === null && stationId.value === null) floorId.value = null;
        picked.value = null;
        stationId.value = null;
      }),
  };
}
