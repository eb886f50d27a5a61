/** Over the canvas: the panel for measuring or for sections. */
import { t } from '../language/language.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { SectionPanel } from '../section/section-panel.tsx';
import type { Store } from '../store.ts';
import { MeasurePanel } from './measure-panel.tsx';

export function SiteTools({ store, view }: { store: Store; view: PlanView }) {
  const { panel } = store.measuring;
  if (panel.value === null) return null;
  return (
    <div class="site-tools">
      <section class="card site-panel" aria-label={panel.value === 'measure' ? t('Measure') : t('Section')}>
        {panel.value === 'measure' ? (
          <MeasurePanel store={store} view={view} />
        ) : (
          <SectionPanel store={store} view={view} />
        )}
      </section>
    </div>
  );
}
