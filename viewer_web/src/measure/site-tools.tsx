/** Over the canvas: the plan view, measuring and sections. */
import { t } from '../language/language.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import { SectionPanel } from '../section/section-panel.tsx';
import type { Store } from '../store.ts';
import { MeasurePanel } from './measure-panel.tsx';

export function SiteTools({ store, view }: { store: Store; view: PlanView }) {
  const { measuring } = store;
  const { panel } = measuring;
  const open = (which: 'measure' | 'section'): void => {
    const isOpen = panel.peek() === which;
    panel.value = isOpen ? null : which;
    measuring.measurer.peek()?.take(!isOpen && which === 'measure' ? 'distance' : null);
    // From there on arrows move the crosshair.
    if (!isOpen && which === 'measure') view.focus();
  };
  const off = whyNoPicture(store);
  const hasSection = store.sectionBox.value !== null || store.sectionLine.value !== null;
  return (
    <div class="site-tools">
      <div class="site-tool-bar" role="toolbar" aria-label={t('Plan view, measuring and sections')}>
        <button
          type="button"
          class="tool"
          aria-pressed={store.isPlanView.value}
          disabled={off !== null}
          title={off ?? t('Straight from above, to scale, with grid and north (P)')}
          onClick={() => (store.isPlanView.value ? view.showAll('side') : view.showPlan())}
        >
          {t('Plan view')}
        </button>
        <button
          id="site-tool-measure"
          type="button"
          class="tool"
          aria-pressed={panel.value === 'measure'}
          aria-expanded={panel.value === 'measure'}
          title={t('Distances, heights, angles and areas (M)')}
          onClick={() => open('measure')}
        >
          {t('Measure')}
        </button>
        <button
          id="site-tool-section"
          type="button"
          class="tool"
          aria-pressed={panel.value === 'section' || hasSection}
          aria-expanded={panel.value === 'section'}
          disabled={off !== null && !hasSection}
          title={off ?? t('Cut the building with a box, or along a line on the plan')}
          onClick={() => open('section')}
        >
          {t('Section')}
        </button>
      </div>
      {panel.value !== null && (
        <section class="card site-panel" aria-label={panel.value === 'measure' ? t('Measure') : t('Section')}>
          {panel.value === 'measure' ? (
            <MeasurePanel store={store} view={view} />
          ) : (
            <SectionPanel store={store} view={view} />
          )}
        </section>
      )}
    </div>
  );
}
