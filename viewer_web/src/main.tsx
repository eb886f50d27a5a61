/** Starts the viewer: loads the plan the server gives, and keeps the address and the view in step. */
import { batch, effect } from '@preact/signals';
import { render } from 'preact';
import type { Extent } from './floors/cut.ts';
import { fetchPlan, type LoadedPlan } from './load/fetch-plan.ts';
import { PlanLoadError } from './load/plan-load-error.ts';
import { App } from './panels/app.tsx';
import './style.css';
import { createStore, type Store } from './store.ts';
import { formatUrlState, parseUrlState } from './url-state.ts';

async function start(): Promise<void> {
  const store = createStore();
  render(<App store={store} />, document.getElementById('app') as HTMLElement);
  try {
    const loaded = await fetchPlan((step, fraction) => {
      store.phase.value = { kind: 'loading', step, fraction };
    });
    document.title = `${loaded.plan.scene.file.split(/[\\/]/).pop()} – tlsplan`;
    batch(() => {
      store.loaded.value = loaded;
      store.extent.value = extentOfStage(loaded);
      applyAddress(store);
      store.phase.value = { kind: 'ready' };
    });
    followAddress(store);
  } catch (error) {
    const message = error instanceof Error ? error.message : String(error);
    store.phase.value = { kind: 'failed', message };
    // What is not a damaged plan is a fault of ours: let the console have where it happened.
    if (!(error instanceof PlanLoadError)) throw error;
  }
}

function extentOfStage({ stage }: LoadedPlan): Extent {
  const min: [number, number, number] = [Infinity, Infinity, Infinity];
  const max: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  const corners = stage.triangles.cornersM;
  for (let i = 0; i < corners.length; i++) {
    const axis = i % 3;
    if (corners[i] < min[axis]) min[axis] = corners[i];
    if (corners[i] > max[axis]) max[axis] = corners[i];
  }
  return { minM: min, maxM: max };
}

/** Names in an old address that the plan does not know are ignored. */
function applyAddress(store: Store): void {
  const { floorId, stationId } = parseUrlState(window.location.hash);
  const plan = store.loaded.value?.plan;
  batch(() => {
    store.chooseFloor(plan?.floors.find(({ id }) => id === floorId)?.id ?? null);
    store.chooseStation(plan?.stations.find(({ id }) => id === stationId)?.id ?? null);
  });
}

function followAddress(store: Store): void {
  effect(() => {
    const state = formatUrlState({ floorId: store.floorId.value, stationId: store.stationId.value });
    if (state !== window.location.hash) window.history.replaceState(null, '', state || window.location.pathname);
  });
  window.addEventListener('hashchange', () => applyAddress(store));
}

void start();
