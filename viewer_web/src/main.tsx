/** Starts the viewer: loads the plan the server gives, and keeps the address and the view in step. */
import { batch, effect } from '@preact/signals';
import { render } from 'preact';
import { extentsOf } from './floors/cut.ts';
import { fetchPlan } from './load/fetch-plan.ts';
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
      store.extents.value = extentsOf(loaded.stage);
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
