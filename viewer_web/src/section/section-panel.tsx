/** Sections of the building: a box to drag, a line on the plan, and the way back. */

import { batch } from '@preact/signals';
import { t } from '../language/language.ts';
import { LengthField } from '../panels/length-field.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { sideName } from './box-handles.tsx';
import { BOX_SIDES, withSide } from './planes.ts';
import { boxAroundShown, endSection } from './sections.ts';

export function SectionPanel({ store, view }: { store: Store; view: PlanView }) {
  const { measuring, sectionBox, sectionLine } = store;
  const isDrawing = measuring.tool.value === 'section';
  const isAny = sectionBox.value !== null || sectionLine.value !== null;
  return (
    <>
      <div class="buttons">
        <button
          type="button"
          class="button button-small"
          aria-pressed={sectionBox.value !== null}
          onClick={() => {
            if (sectionBox.value === null) boxAroundShown(store);
            else if (sectionLine.value === null) endSection(store);
            else sectionBox.value = null;
          }}
        >
          {t('Box')}
        </button>
        <button
          type="button"
          class="button button-small"
          aria-pressed={isDrawing || sectionLine.value !== null}
          onClick={() => {
            drawLine(store, !isDrawing);
            // From there on arrows move the crosshair.
            if (!isDrawing) view.focus();
          }}
        >
          {t('Line on the plan')}
        </button>
        {isAny && (
          <button type="button" class="button button-small" onClick={() => endSection(store)}>
            {t('Whole building')}
          </button>
        )}
      </div>
      {isDrawing && (
        <p class="hint">
          {t('Click both ends of the line. What lies to the left of it is kept. Keys: arrows and Enter.')}
        </p>
      )}
      {!isDrawing && !isAny && (
        <p class="hint">{t('Box: drag its sides. Line: a vertical section along it, seen squarely.')}</p>
      )}
      {sectionLine.value !== null && <LineControls store={store} />}
      {sectionBox.value !== null && <BoxFields store={store} />}
    </>
  );
}

/** A line is drawn on the plan, with the floors as they were before the last section. */
function drawLine(store: Store, isOn: boolean): void {
  batch(() => {
    if (isOn && store.sectionLine.peek() !== null) endSection(store);
    store.measuring.measurer.peek()?.take(isOn ? 'section' : null);
    if (isOn) store.isPlanView.value = true;
  });
}

function LineControls({ store }: { store: Store }) {
  const { sectionLine, isFacing } = store;
  return (
    <div class="controls">
      <label class="check">
        <input
          type="checkbox"
          checked={isFacing.value}
          onChange={(event) => {
            isFacing.value = event.currentTarget.checked;
          }}
        />
        {t('Look at it squarely, to scale')}
      </label>
      <button
        type="button"
        class="button button-small"
        onClick={() => {
          const line = sectionLine.peek();
          if (line !== null) sectionLine.value = { ...line, isFlipped: !line.isFlipped };
        }}
      >
        {t('Look the other way')}
      </button>
    </div>
  );
}

function BoxFields({ store }: { store: Store }) {
  const box = store.sectionBox.value;
  const offsetM = store.loaded.value?.stage.offsetM ?? [0, 0, 0];
  if (box === null) return null;
  return (
    <fieldset class="fields section-fields">
      <legend class="muted">{t('Sides of the box, scene coordinates')}</legend>
      {BOX_SIDES.map((side) => (
        <LengthField
          key={sideName(side)}
          label={sideName(side)}
          digits={2}
          valueM={(side.end === 'min' ? box.minM : box.maxM)[side.axis] + offsetM[side.axis]}
          onValue={(toM) => {
            store.sectionBox.value = withSide(box, side, toM - offsetM[side.axis]);
          }}
        />
      ))}
    </fieldset>
  );
}
