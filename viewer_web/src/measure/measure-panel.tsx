/** What is measured: the tool in hand, how it goes on, and the results with the coordinates of their points. */

import { useState } from 'preact/hooks';
import { inSentence, t } from '../language/language.ts';
import { coordinatesWords, unitName } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { siteOf, siteWords } from './site.ts';
import type { MeasureKind, Measurement, MeasurePoint } from './state.ts';
import { KIND_WORDS, resultOf, titleOf } from './words.ts';

const KINDS = [...(Object.keys(KIND_WORDS) as MeasureKind[]), 'surface' as const];
const NAMES = { ...KIND_WORDS, surface: t('Surface') } as const;
const HINTS: Readonly<Record<Tool, string>> = {
  surface: t('Click a surface: what it is, and which stations see it.'),
  distance: t('Click two points.'),
  height: t('Click two points: their difference in height.'),
  angle: t('Click three points: the angle is at the second.'),
  area: t('Click the corners; close it at the first.'),
};

type Tool = MeasureKind | 'surface';

export function MeasurePanel({ store, view }: { store: Store; view: PlanView }) {
  const { measuring } = store;
  const tool = measuring.tool.value;
  const kind = tool === 'section' ? null : tool;
  const take = (one: Tool): void => {
    measuring.measurer.peek()?.take(tool === one ? null : one);
    if (tool !== one) view.focus();
  };
  return (
    <>
      <div class="measure-kinds">
        {KINDS.map((one) => (
          <button
            key={one}
            type="button"
            class="button button-small"
            aria-pressed={tool === one}
            onClick={() => take(one)}
          >
            {NAMES[one]}
          </button>
        ))}
      </div>
      {kind !== null && <UnderWay store={store} kind={kind} />}
      <Results store={store} />
    </>
  );
}

function UnderWay({ store, kind }: { store: Store; kind: Tool }) {
  const { points, next, measurer } = store.measuring;
  const n = points.value.length;
  return (
    <>
      <p class="hint">
        {n === 0 ? HINTS[kind] : t('{n, plural, one {# point} other {# points}} taken.', { n })}{' '}
        {t('Corners and edges snap.')}
      </p>
      <p class="hint hint-keys">
        {t(
          'Keys: arrows move a crosshair, Shift finely; Enter takes the point, Backspace takes it back, Escape leaves.',
        )}
      </p>
      {next.value !== null && (
        <Coordinates store={store} name={t('On {title}', { title: WORDS_OF_SNAP[next.value.on] })} point={next.value} />
      )}
      {n > 0 && (
        <div class="buttons">
          {kind === 'area' && (
            <button
              type="button"
              class="button button-primary button-small"
              disabled={n < 3}
              onClick={() => measurer.value?.finish()}
            >
              {t('Finish')}
            </button>
          )}
          <button type="button" class="button button-small" onClick={() => measurer.value?.takeBack()}>
            {t('Remove last point')}
          </button>
        </div>
      )}
    </>
  );
}

const WORDS_OF_SNAP = {
  corner: t('a corner'),
  edge: t('an edge'),
  surface: t('a surface'),
  station: t('a station'),
} as const;

function Results({ store }: { store: Store }) {
  const { done } = store.measuring;
  if (done.value.length === 0) return null;
  return (
    <div class="measurements">
      <ul aria-label={t('Measurements')} aria-live="polite">
        {[...done.value].reverse().map((one) => (
          <Row key={one.id} store={store} measurement={one} />
        ))}
      </ul>
      {done.value.length > 1 && (
        <button
          type="button"
          class="button button-small"
          onClick={() => {
            done.value = [];
          }}
        >
          {t('Remove all')}
        </button>
      )}
    </div>
  );
}

function Row({ store, measurement }: { store: Store; measurement: Measurement }) {
  const [isOpen, setOpen] = useState(false);
  const { id, kind, points } = measurement;
  const { main, rest, warning } = resultOf(measurement);
  const { done } = store.measuring;
  return (
    <li data-testid="measurement" data-kind={kind}>
      <header>
        <span>
          <span class="muted">{titleOf(measurement)}</span> <strong>{main}</strong>
        </span>
        <span>
          <button type="button" class="button button-small" aria-expanded={isOpen} onClick={() => setOpen(!isOpen)}>
            {t('Points')}
          </button>
          <button
            type="button"
            class="icon"
            aria-label={t('Remove {what}', { what: `${inSentence(KIND_WORDS[kind])} ${main}` })}
            onClick={() => {
              done.value = done.value.filter((one) => one.id !== id);
            }}
          >
            ×
          </button>
        </span>
      </header>
      <dl class="figures">
        {rest.map(([name, value]) => (
          <Figure key={name} name={name} value={value} />
        ))}
      </dl>
      {warning !== null && <p class="note-warn">{warning}</p>}
      {isOpen &&
        points.map((point, i) => <Coordinates key={`${point.sceneM}`} store={store} name={`${i + 1}`} point={point} />)}
    </li>
  );
}

function Coordinates({ store, name, point }: { store: Store; name: string; point: MeasurePoint }) {
  const scene = store.loaded.value?.plan.scene;
  const site = scene === undefined ? null : siteOf(scene);
  return (
    <dl class="figures measure-place">
      <Figure
        name={name}
        value={coordinatesWords(point.sceneM)}
        hint={t('Scene coordinates x, y, z in {unit}', { unit: unitName() })}
      />
      {site !== null && <Figure name={t('Site')} value={siteWords(site, point.sceneM)} hint={site.name} />}
    </dl>
  );
}
