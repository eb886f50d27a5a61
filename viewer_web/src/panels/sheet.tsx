/** A sheet over the canvas for what needs more room than the sidebar has. */
import { useEffect, useRef } from 'preact/hooks';
import { countingOf, networkOf } from '../network/graph.ts';
import { Graph } from '../network/graph-view.tsx';
import { Matrix } from '../network/matrix.tsx';
import { GraphKey } from '../network/network-tab.tsx';
import { StrengthLegend } from '../network/strength-legend.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import { Panorama } from '../stations/panorama.tsx';
import type { Store } from '../store.ts';
import type { SheetId } from './state.ts';

const TITLES: Readonly<Record<SheetId, string>> = {
  graph: 'Links between stations',
  matrix: 'Overlap by pair',
  panorama: 'Panorama',
};

export function Sheet({ store, view }: { store: Store; view: PlanView | null }) {
  const id = store.sheet.value;
  const closer = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (id !== null) closer.current?.focus();
  }, [id]);
  if (id === null) return null;
  return (
    <section class={`sheet sheet-${id}`} aria-label={TITLES[id]}>
      <header>
        <h2>{TITLES[id]}</h2>
        <button
          ref={closer}
          type="button"
          class="icon"
          aria-label="Close"
          onClick={() => {
            store.sheet.value = null;
          }}
        >
          ×
        </button>
      </header>
      <div class="sheet-page">
        {id === 'panorama' ? <Panorama store={store} view={view} /> : <Network store={store} id={id} />}
      </div>
    </section>
  );
}

function Network({ store, id }: { store: Store; id: SheetId }) {
  const plan = store.loaded.value?.plan;
  if (plan === undefined) return null;
  const counting = countingOf(plan);
  const ids = store.shownStations.value.map((station) => station.id);
  return (
    <>
      {id === 'graph' ? (
        <>
          <Graph store={store} report={networkOf(ids, store.shownLinks.value, counting)} width={760} />
          <GraphKey />
        </>
      ) : (
        <Matrix store={store} counting={counting} />
      )}
      <StrengthLegend isDark={store.isDark.value} />
    </>
  );
}
