/** The whole page: loading and failing in words, then the field view, or the plan in 3D with its panels. */

import type { ReadonlySignal } from '@preact/signals';
import type { DrawingView } from '../drawing/drawing-view.tsx';
import { FieldView } from '../field/field-view.tsx';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { Store } from '../store.ts';
import type { Workspace } from './workspace.tsx';

interface AppProps {
  readonly store: Store;
  /** The application in 3D, once it is there. */
  readonly workspace: ReadonlySignal<typeof Workspace | null>;
  /** The page of the drawing, once somebody opens it. */
  readonly drawing: ReadonlySignal<typeof DrawingView | null>;
}

export function App({ store, workspace, drawing }: AppProps) {
  const phase = store.phase.value;
  const loaded = store.loaded.value;
  const inField = store.page.value === 'field' ? (loaded ?? store.fieldPlan.value) : null;
  const [InFull, InDrawing] = [workspace.value, drawing.value];
  if (phase.kind === 'failed') {
    return (
      <main class="message">
        <h1>{t('The plan can’t be shown')}</h1>
        <p role="alert">{phase.message}</p>
        <button type="button" class="tool" onClick={() => window.location.reload()}>
          {t('Try again')}
        </button>
        {store.planBase.value !== OWN_PLAN && (
          <button
            type="button"
            class="link"
            onClick={() => {
              window.location.hash = '';
              window.location.reload();
            }}
          >
            {t('Open the main plan')}
          </button>
        )}
      </main>
    );
  }
  if (inField !== null) return <FieldView store={store} loaded={inField} />;
  const isDrawing = phase.kind === 'drawing' || (loaded !== null && store.page.value === 'drawing');
  if (isDrawing && InDrawing !== null && store.drawing !== null) {
    return <InDrawing store={store} editor={store.drawing} />;
  }
  if (isDrawing || phase.kind !== 'ready' || loaded === null || InFull === null) {
    const { step, fraction } = phase.kind === 'loading' ? phase : { step: '', fraction: null };
    return (
      <main class="message" aria-busy="true">
        <p role="status">{step} …</p>
        <progress aria-label={step} {...(fraction === null ? {} : { value: fraction })} />
      </main>
    );
  }
  return <InFull store={store} loaded={loaded} />;
}
