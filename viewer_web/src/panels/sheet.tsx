/** A sheet over the canvas for what needs more room than the sidebar has. */

import { useSignal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { t } from '../language/language.ts';
import { type Counting, countingOf, networkOf } from '../network/graph.ts';
import { Graph } from '../network/graph-view.tsx';
import { Matrix } from '../network/matrix.tsx';
import { GraphKey } from '../network/network-tab.tsx';
import { OverlapLegend, StrengthLegend } from '../network/strength-legend.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import { Panorama } from '../stations/panorama.tsx';
import type { Store } from '../store.ts';
import type { SheetId } from './state.ts';

const TITLES: Readonly<Record<SheetId, string>> = {
  graph: t('Links between stations'),
  matrix: t('Overlap by pair'),
  panorama: t('Panorama'),
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
          aria-label={t('Close')}
          onClick={() => {
            store.sheet.value = null;
          }}
        >
          ×
        </button>
      </header>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: it scrolls, and arrows scroll what has the focus. */}
      <div class="sheet-page" tabIndex={0}>
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
        <MatrixWithFigures store={store} counting={counting} />
      )}
      <StrengthLegend isDark={store.isDark.value} />
    </>
  );
}

function MatrixWithFigures({ store, counting }: { store: Store; counting: Counting }) {
  const hasFigures = useSignal(true);
  return (
    <>
      <label class="check">
        <input
          type="checkbox"
          checked={hasFigures.value}
          onChange={(event) => {
            hasFigures.value = event.currentTarget.checked;
          }}
        />
        {t('Figures: overlap in percent above the diagonal, strength below it')}
      </label>
      <Matrix store={store} counting={counting} hasFigures={hasFigures.value} />
      <OverlapLegend isDark={store.isDark.value} threshold={counting.threshold} />
    </>
  );
}
