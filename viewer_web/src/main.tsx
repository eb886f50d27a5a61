/** Starts the viewer: loads the plan the server gives, and keeps the address and the view in step. */
import { batch, effect, type Signal, signal } from '@preact/signals';
import { render } from 'preact';
import { ApiClient } from './api/client.ts';
import { ReviewClient } from './api/review-client.ts';
import { UndoMemory } from './api/undo-memory.ts';
import type { DrawingView } from './drawing/drawing-view.tsx';
import { DEFAULT_CUT_M, extentsOf } from './floors/cut.ts';
import { restoreHatching } from './heat/hatching.ts';
import { TIMES_SEEN } from './heat/layers.ts';
import { language, loadTexts } from './language/language.ts';
import { fetchFieldPlan, fetchPlan } from './load/fetch-plan.ts';
import { OWN_PLAN, planBaseOf } from './load/plan-base.ts';
import type { PlanJson } from './load/plan-json.ts';
import { PlanLoadError } from './load/plan-load-error.ts';
import { App } from './panels/app.tsx';
import { restoreCharacterKeys } from './panels/character-keys.ts';
import { type PageId, TAB_IDS } from './panels/state.ts';
import { restoreUnits } from './panels/units.ts';
import type { Workspace } from './panels/workspace.tsx';
import './styles.ts';
import { createStore, type Store } from './store.ts';
import { formatUrlState, parseUrlState, SHOWN, type Shown, type UrlState } from './url-state.ts';

async function start(): Promise<void> {
  const mode = document.querySelector<HTMLMetaElement>('meta[name="tlsplan-mode"]')?.content;
  const isStatic = mode === 'static';
  document.documentElement.lang = language;
  restoreUnits(window.localStorage);
  restoreCharacterKeys(window.localStorage);
  restoreHatching(window.localStorage);
  const undoMemory = new UndoMemory(window.sessionStorage);
  const reviewClient = isStatic
    ? null
    : new ReviewClient(new ApiClient(), { storage: window.localStorage, undoMemory });
  const store = createStore({ isStatic, reviewClient });
  store.planBase.value = planBaseOf(parseUrlState(window.location.hash).planBase);
  store.page.value = pageOf(parseUrlState(window.location.hash));
  const workspace = signal<typeof Workspace | null>(null);
  const drawing = signal<typeof DrawingView | null>(null);
  effect(() => {
    if (store.page.value !== 'drawing' && store.phase.value.kind !== 'drawing') return;
    void withTexts(() => import('./drawing/drawing-view.tsx')).then((part) => {
      drawing.value = part.DrawingView;
    });
  });
  render(<App store={store} workspace={workspace} drawing={drawing} />, document.getElementById('app') as HTMLElement);
  try {
    if (store.page.value === 'field') await openField(store);
    await openPlan(store, workspace);
  } catch (error) {
    await store.drawing?.open();
    if (store.drawing?.hasPlan.value === false) {
      store.phase.value = { kind: 'drawing' };
      return;
    }
    const message = error instanceof Error ? error.message : String(error);
    store.phase.value = { kind: 'failed', message };
    // What is not a damaged plan is a fault of ours: let the console have where it happened.
    if (!(error instanceof PlanLoadError)) throw error;
  }
}

/** Texts are looked up as the modules are loaded. */
async function withTexts<Part>(load: () => Promise<Part>): Promise<Part> {
  await loadTexts(language, 'rest');
  return load();
}

const PAGES: readonly PageId[] = ['plan', 'field', 'drawing'];

const pageOf = ({ view }: UrlState): PageId => PAGES.find((page) => page === view) ?? 'plan';

const onStepOf = (store: Store) => (step: string, fraction: number | null) => {
  store.phase.value = { kind: 'loading', step, fraction };
};

function name(plan: PlanJson): void {
  document.title = `${plan.scene.file.split(/[\\/]/).pop()} – tlsplan`;
}

/** What a phone in the field needs, until the full plan is wanted. */
async function openField(store: Store): Promise<void> {
  const field = await fetchFieldPlan(store.planBase.value, onStepOf(store));
  name(field.plan);
  store.fieldPlan.value = field;
  void store.reviewClient?.open();
  const reload = (): void => window.location.reload();
  window.addEventListener('hashchange', reload);
  const endings: (() => void)[] = [];
  await new Promise<void>((leave) => {
    const end = effect(() => {
      if (store.page.value === 'plan') leave();
    });
    endings.push(end);
  });
  for (const end of endings) end();
  window.removeEventListener('hashchange', reload);
}

async function openPlan(store: Store, workspace: Signal<typeof Workspace | null>): Promise<void> {
  const [loaded, part] = await Promise.all([
    fetchPlan(store.planBase.value, onStepOf(store)),
    withTexts(() => import('./panels/workspace.tsx')),
  ]);
  name(loaded.plan);
  const { page } = store;
  const wasInField = store.fieldPlan.value !== null;
  batch(() => {
    workspace.value = part.Workspace;
    store.loaded.value = loaded;
    store.extents.value = extentsOf(loaded.stage);
    applyAddress(store);
    // The address is still that of the field view which was left.
    if (wasInField) page.value = 'plan';
    store.phase.value = { kind: 'ready' };
  });
  followAddress(store);
  if (!wasInField) void store.reviewClient?.open();
}

/** Names in an old address that the plan does not know are ignored. */
function applyAddress(store: Store): void {
  const state = parseUrlState(window.location.hash);
  const plan = store.loaded.value?.plan;
  const nFiles = store.loaded.value?.stage.files.length ?? 0;
  const isStation = (id: string | null): boolean => plan?.stations.some((station) => station.id === id) ?? false;
  batch(() => {
    const floorId = plan?.floors.find(({ id }) => id === state.floorId)?.id ?? null;
    store.chooseFloor(floorId);
    store.chooseStation(isStation(state.stationId) ? state.stationId : null);
    if (state.pair?.every(isStation)) {
      // It opens its floor, as a station does, unless the address names another.
      store.choosePair(state.pair);
      if (floorId !== null) store.chooseFloor(floorId);
    }
    store.layerId.value = state.layerId ?? TIMES_SEEN;
    store.page.value = pageOf(state);
    store.tab.value = TAB_IDS.find((id) => id === state.tab) ?? 'plan';
    store.cutM.value = state.cutM ?? DEFAULT_CUT_M;
    for (const one of SHOWN) showing(store)[one].value = state.shows.includes(one) === SHOWN_AT[one];
    applySection(store, state);
    store.hiddenFiles.value = new Set(state.hiddenFiles.filter((file) => file < nFiles));
    store.compareBase.value = state.compareBase === null ? null : planBaseOf(state.compareBase);
  });
  // After the choices: each sends the camera to a place of its own.
  store.startsWalking.value = state.isWalking;
  store.camera.value = state.camera;
}

function applySection(store: Store, { sectionBox, sectionLine }: UrlState): void {
  store.sectionBox.value = sectionBox;
  store.sectionLine.value = sectionLine;
  if (sectionLine === null) store.isFacing.value = false;
  const isAny = sectionBox !== null || sectionLine !== null;
  store.shownBefore.value = isAny ? (store.shownBefore.peek() ?? { floorId: null, isSpread: true }) : null;
}

/** The switches that an address names, and at what they stand where it does. */
const SHOWN_AT: Readonly<Record<Shown, boolean>> = {
  links: true,
  clouds: true,
  route: true,
  whole: false,
  open: true,
  flat: true,
  square: true,
};

function showing(store: Store): Readonly<Record<Shown, Signal<boolean>>> {
  return {
    links: store.showLinks,
    clouds: store.showClouds,
    route: store.showRoute,
    whole: store.isSpread,
    open: store.hidesCeilings,
    flat: store.isPlanView,
    square: store.isFacing,
  };
}

function stateOf(store: Store): UrlState {
  return {
    floorId: store.floorId.value,
    stationId: store.stationId.value,
    layerId: store.layerId.value === TIMES_SEEN ? null : store.layerId.value,
    tab: store.tab.value === 'plan' ? null : store.tab.value,
    view: store.page.value === 'plan' ? null : store.page.value,
    pair: store.pair.value,
    planBase: store.planBase.value === OWN_PLAN ? null : store.planBase.value,
    compareBase: store.compareBase.value,
    camera: store.camera.value,
    isWalking: store.isWalking.value,
    cutM: store.cutM.value === DEFAULT_CUT_M ? null : store.cutM.value,
    sectionBox: store.sectionBox.value,
    sectionLine: store.sectionLine.value,
    shows: SHOWN.filter((one) => showing(store)[one].value === SHOWN_AT[one]),
    hiddenFiles: [...store.hiddenFiles.value].sort((a, b) => a - b),
  };
}

/** Browsers refuse to be told a new address with every picture of a walk. */
const CAMERA_PAUSE_MS = 300;

function followAddress(store: Store): void {
  let [last, pending] = ['', 0];
  const write = (): void => {
    window.clearTimeout(pending);
    pending = 0;
    const state = formatUrlState(stateOf(store));
    if (state !== window.location.hash) window.history.replaceState(null, '', state || window.location.pathname);
  };
  effect(() => {
    const choices = formatUrlState({ ...stateOf(store), camera: null });
    const isCameraAlone = choices === last && store.camera.value !== null;
    last = choices;
    if (!isCameraAlone) write();
    else if (pending === 0) pending = window.setTimeout(write, CAMERA_PAUSE_MS);
  });
  window.addEventListener('hashchange', () => {
    // Another plan is another page: everything of the first goes with it.
    if (planBaseOf(parseUrlState(window.location.hash).planBase) !== store.planBase.value) window.location.reload();
    else applyAddress(store);
  });
}

void start();
