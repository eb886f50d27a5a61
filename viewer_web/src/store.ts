/** The one store: what is loaded, what is shown, what is chosen. The panels and the 3D side read the same signals. */
import { batch, computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { Desk } from './api/desk.ts';
import { type CompareState, createCompareState } from './compare/comparison.ts';
import { createEditing, type Editing } from './edit/editing.ts';
import {
  DEFAULT_CUT_M,
  type extentsOf,
  floorBeside,
  highestCutM,
  type Slice,
  slicesOf,
  WHOLE_BUILDING,
} from './floors/cut.ts';
import { type HeatLayer, layersOf, type PatchValues, TIMES_SEEN } from './heat/layers.ts';
import type { Spread } from './heat/statistics.ts';
import type { ThinnedCloud } from './load/cloud-rows.ts';
import type { LoadedPlan } from './load/fetch-plan.ts';
import { rampLayersOf } from './load/layers.ts';
import { OWN_PLAN } from './load/plan-base.ts';
import type { PlanLink, PlanRoute, UnseenSurface } from './load/plan-json.ts';
import type { StageElement } from './load/stage.ts';
import { type CoveredStations, NONE_COVERED } from './stations/covered.ts';
import { type ShownStation, shownStationsOf } from './stations/shown.ts';

export type PageId = 'plan' | 'field';
export type TabId = 'plan' | 'unseen' | 'network' | 'edit' | 'runs' | 'review';
/** What the sheet over the canvas shows. */
export type SheetId = 'graph' | 'matrix' | 'panorama';
export type CloudPaint = 'range' | 'incidence' | 'intensity' | 'station';
/** Two stations, as a link names them. */
export type Pair = readonly [string, string];
/** Values of a layer for all patches; null: this source has none, those of the plan folder are shown. */
export type LayerSource = (layerId: string) => Promise<PatchValues | null>;

/** A layer besides those of the plan folder, such as a difference to another plan, with its values. */
export interface ExtraLayer {
  readonly layer: HeatLayer;
  readonly values: PatchValues;
}

export type LayerState =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading'; readonly layer: HeatLayer }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly layer: HeatLayer; readonly spread: Spread | null };

/** What is pointed out in place of the layer, see `pair`, `unseenFocus` and `showsOwn`. */
export type Marking =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading' }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly areaM2: number };

/** One piece of an unseen surface that is looked at. */
export interface UnseenFocus {
  readonly surface: UnseenSurface;
  readonly piece: number;
}

/** What stations see where they are not those of the plan folder; null: the plan folder knows. */
export interface StationSource {
  /** One bit a patch. */
  seen(stationId: string): Promise<Uint8Array | null>;
  /** Bytes as of viewer/lost/*.u32. */
  lost(stationId: string): Promise<ArrayBuffer | null>;
  /** Bytes as of viewer/clouds/*.u16. */
  cloud(stationId: string): Promise<ArrayBuffer | null>;
}

/** Stations and links that are shown in place of the plan's. */
export interface Draft {
  readonly stations: readonly ShownStation[];
  readonly links: readonly PlanLink[];
}

export type Phase =
  | { readonly kind: 'loading'; readonly step: string; readonly fraction: number | null }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'ready' };

export type CloudState =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading'; readonly n: number; readonly of: number }
  | { readonly kind: 'failed'; readonly message: string }
  /** Of every cloud each `stride`-th beam of each `stride`-th row. */
  | { readonly kind: 'shown'; readonly nReturns: number; readonly nStations: number; readonly stride: number };

export type Extents = ReturnType<typeof extentsOf>;

/** A surface that was clicked. */
export interface Picked {
  readonly element: StageElement;
  readonly elementIndex: number;
  /** Of the merged list. */
  readonly triangle: number;
  readonly patch: number;
  /** The floor whose ground it is; null: not ground. */
  readonly groundOf: string | null;
  /** Stations that see the patch under the pointer; null: not achievable, or not a surface but a cut. */
  readonly timesSeen: number | null;
  /** Whether the plan is of this surface at all. */
  readonly isAsked: boolean;
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
  readonly hidesCeilings: Signal<boolean>;
  readonly slices: ReadonlySignal<readonly Slice[]>;
  /** The whole plan, or what is needed in the field. */
  readonly page: Signal<PageId>;
  /** Which page of the sidebar. */
  readonly tab: Signal<TabId>;
  /** The page only shows files: nothing that needs the server behind them. */
  readonly isStatic: boolean;
  /** What the server knows beyond files; null: there is no such server. */
  readonly desk: Desk | null;
  /** What is being edited and not committed yet. */
  readonly editing: Editing;
  /** Folder of the plan that is shown, and of one to compare it with; `OWN_PLAN` is the one the page was started for. */
  readonly planBase: Signal<string>;
  readonly compareBase: Signal<string | null>;
  /** What became of the other plan. */
  readonly comparison: Signal<CompareState>;
  /** What the building is painted by: the id of a layer, or `PLAIN`. */
  readonly layerId: Signal<string>;
  readonly extraLayers: Signal<readonly ExtraLayer[]>;
  /** All that it can be painted by. */
  readonly layers: ReadonlySignal<readonly HeatLayer[]>;
  /** What became of it. */
  readonly layerState: Signal<LayerState>;
  /** Where values of layers come from before the plan folder is asked. */
  readonly layerSource: Signal<LayerSource | null>;
  /** The page is shown in dark colours. */
  readonly isDark: Signal<boolean>;
  readonly draft: Signal<Draft | null>;
  /** Of the draft, else of the plan. */
  readonly shownStations: ReadonlySignal<readonly ShownStation[]>;
  readonly shownLinks: ReadonlySignal<readonly PlanLink[]>;
  readonly stationSource: Signal<StationSource | null>;
  readonly pair: Signal<Pair | null>;
  readonly unseenFocus: Signal<UnseenFocus | null>;
  /** Point out what only the chosen station sees. */
  /** Stations that other floors hide in the picture. */
  readonly covered: Signal<CoveredStations>;
  readonly showsOwn: Signal<boolean>;
  /** Of what would be lost with the station, what this requirement would lose; null: all of it. */
  readonly ownRequirement: Signal<string | null>;
  readonly marking: Signal<Marking>;
  /** Where the camera was left by hand: position and target, local metres; null: where the choice of floor puts it. */
  readonly camera: Signal<readonly number[] | null>;
  readonly showLinks: Signal<boolean>;
  readonly stationId: Signal<string | null>;
  readonly cloud: Signal<CloudState>;
  readonly cloudPaint: Signal<CloudPaint>;
  /** The clouds of all stations of the shown floors, not the chosen one's alone. */
  readonly showClouds: Signal<boolean>;
  /** End of the colours by range. */
  readonly cloudFarthestM: Signal<number>;
  /** The chosen station's, once it is there. */
  readonly chosenCloud: Signal<(ThinnedCloud & { readonly stationId: string }) | null>;
  readonly picked: Signal<Picked | null>;
  readonly isWalking: Signal<boolean>;
  /** The address asks for a walk from where it puts the camera. */
  readonly startsWalking: Signal<boolean>;
  readonly showRoute: Signal<boolean>;
  /** The walk of a draft; null: the plan's. */
  readonly draftRoute: Signal<PlanRoute | null>;
  readonly shownRoute: ReadonlySignal<PlanRoute | null>;
  readonly sheet: Signal<SheetId | null>;
  readonly isSidebarOpen: Signal<boolean>;
  chooseFloor(floorId: string | null): void;
  stepFloor(step: number): void;
  chooseStation(stationId: string | null): void;
  stepStation(step: number): void;
  choosePair(pair: Pair | null): void;
  lookAtUnseen(focus: UnseenFocus | null): void;
  pick(picked: Picked | null): void;
  clear(): void;
}

interface StoreOptions {
  readonly isStatic?: boolean;
  readonly desk?: Desk | null;
}

/** So much above a piece that is looked at the floor is cut. */
const CUT_ABOVE_M = 0.1;

export function createStore({ isStatic = false, desk = null }: StoreOptions = {}): Store {
  const phase = signal<Phase>({ kind: 'loading', step: 'Reading the plan', fraction: null });
  const loaded = signal<LoadedPlan | null>(null);
  const extents = signal<Extents | null>(null);
  const floorId = signal<string | null>(null);
  const isSpread = signal(true);
  const cutM = signal(DEFAULT_CUT_M);
  const hidesCeilings = signal(false);
  const stationId = signal<string | null>(null);
  const picked = signal<Picked | null>(null);
  const extraLayers = signal<readonly ExtraLayer[]>([]);
  const pair = signal<Pair | null>(null);
  const unseenFocus = signal<UnseenFocus | null>(null);
  const showsOwn = signal(false);
  const ownRequirement = signal<string | null>(null);
  const isWalking = signal(false);
  const sheet = signal<SheetId | null>(null);
  const draftRoute = signal<PlanRoute | null>(null);
  const draft = signal<Draft | null>(null);
  const shownStations = computed(() => draft.value?.stations ?? shownStationsOf(loaded.value));
  const slices = computed<readonly Slice[]>(() => {
    const [plan, boxes] = [loaded.value, extents.value];
    if (plan === null || boxes === null) return [];
    if (isWalking.value) return [WHOLE_BUILDING];
    const view = {
      floorId: floorId.value,
      isSpread: isSpread.value,
      cutM: cutM.value,
      hidesCeilings: hidesCeilings.value,
    };
    return slicesOf(view, plan.stage.floors, boxes.whole);
  });

  /** The cut as it was before a piece above it was looked at, and as it was raised for that. */
  let cutBefore: { readonly chosenM: number; readonly raisedM: number } | null = null;
  const raiseCut = (toM: number): void => {
    if (toM <= cutM.value) return;
    cutBefore = { chosenM: cutM.value, raisedM: toM };
    cutM.value = toM;
  };
  const lowerCut = (): void => {
    // Whoever moved the slider meanwhile wants it there.
    if (cutBefore !== null && cutM.value === cutBefore.raisedM) cutM.value = cutBefore.chosenM;
    cutBefore = null;
  };
  /** One thing is chosen at a time: a station, a pair of them, an unseen piece, or a surface. */
  const letGo = (): void => {
    lowerCut();
    stationId.value = null;
    showsOwn.value = false;
    ownRequirement.value = null;
    pair.value = null;
    unseenFocus.value = null;
    picked.value = null;
  };
  const chooseFloor = (id: string | null): void =>
    batch(() => {
      floorId.value = id;
      const station = shownStations.value.find(({ id }) => id === stationId.value);
      if (id !== null && station !== undefined && station.floorId !== id) stationId.value = null;
      picked.value = null;
      if (unseenFocus.value !== null) lowerCut();
      unseenFocus.value = null;
    });
  const chooseStation = (id: string | null): void =>
    batch(() => {
      letGo();
      stationId.value = id;
      const station = shownStations.value.find((candidate) => candidate.id === id);
      // Its floor alone: among spread floors the one above would hide it.
      if (station !== undefined) floorId.value = station.floorId;
    });
  const choosePair = (chosen: Pair | null): void =>
    batch(() => {
      letGo();
      pair.value = chosen;
      const floors = new Set(shownStations.value.filter(({ id }) => chosen?.includes(id)).map((one) => one.floorId));
      const [first] = floors;
      if (first !== undefined) floorId.value = floors.size === 1 ? first : null;
    });
  const lookAtUnseen = (focus: UnseenFocus | null): void =>
    batch(() => {
      letGo();
      unseenFocus.value = focus;
      if (focus === null) return;
      const piece = focus.surface.pieces[focus.piece];
      const floor = loaded.value?.stage.floors.find(({ id }) => id === focus.surface.floor);
      floorId.value = floor?.id ?? null;
      if (floor === undefined) isSpread.value = false;
      // What lies above the cut is not drawn.
      else if (piece !== undefined) {
        const topM = piece.box[1][2] - (loaded.value?.stage.offsetM[2] ?? 0) - floor.elevationM;
        raiseCut(Math.min(topM + CUT_ABOVE_M, highestCutM(floor)));
      }
    });
  const stepStation = (step: number): void => {
    const stations = shownStations.value;
    const shown = floorId.value === null ? stations : stations.filter((station) => station.floorId === floorId.value);
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
    hidesCeilings,
    slices,
    page: signal<PageId>('plan'),
    tab: signal<TabId>('plan'),
    isStatic,
    desk,
    editing: createEditing(),
    planBase: signal(OWN_PLAN),
    compareBase: signal<string | null>(null),
    comparison: createCompareState(),
    layerId: signal(TIMES_SEEN),
    extraLayers,
    layers: computed(() => {
      const layers = loaded.value?.layers ?? null;
      return layersOf(
        rampLayersOf(layers),
        layers?.reasons ?? [],
        extraLayers.value.map(({ layer }) => layer),
      );
    }),
    layerState: signal<LayerState>({ kind: 'none' }),
    isDark: signal(false),
    layerSource: signal<LayerSource | null>(null),
    draft,
    shownStations,
    shownLinks: computed(() => draft.value?.links ?? loaded.value?.plan.registration.links ?? []),
    stationSource: signal<StationSource | null>(null),
    pair,
    unseenFocus,
    covered: signal(NONE_COVERED),
    showsOwn,
    ownRequirement,
    marking: signal<Marking>({ kind: 'none' }),
    camera: signal<readonly number[] | null>(null),
    showLinks: signal(false),
    stationId,
    cloud: signal<CloudState>({ kind: 'none' }),
    cloudPaint: signal<CloudPaint>('range'),
    showClouds: signal(false),
    cloudFarthestM: signal(1),
    chosenCloud: signal<(ThinnedCloud & { readonly stationId: string }) | null>(null),
    picked,
    isWalking,
    startsWalking: signal(false),
    showRoute: signal(false),
    draftRoute,
    shownRoute: computed(() => draftRoute.value ?? loaded.value?.plan.route ?? null),
    sheet,
    isSidebarOpen: signal(true),
    chooseFloor,
    stepFloor: (step) => chooseFloor(floorBeside(floorId.value, step, loaded.value?.stage.floors ?? [])),
    chooseStation,
    stepStation,
    choosePair,
    lookAtUnseen,
    pick: (surface) => {
      picked.value = surface;
    },
    clear: () =>
      batch(() => {
        if (sheet.value !== null) {
          sheet.value = null;
          return;
        }
        const isNothingChosen = [picked, stationId, pair, unseenFocus].every(({ value }) => value === null);
        if (isNothingChosen) floorId.value = null;
        letGo();
      }),
  };
}
