/** What the colours mean: of the layer the building is painted by, or of the clouds where they are shown. */

import { ChangesLegend } from '../compare/changes-legend.tsx';
import { DIFFERENCE_ID } from '../compare/difference.ts';
import { t } from '../language/language.ts';
import { areaWords, lengthWords } from '../panels/figures.ts';
import { DARK, LIGHT } from '../scene/palette.ts';
import { CloudControl } from '../stations/cloud-control.tsx';
import { lossLegend } from '../stations/losses.ts';
import { rampBytes } from '../stations/range-ramp.ts';
import type { ShownStation } from '../stations/shown.ts';
import { cssColor, stationColor } from '../stations/station-color.ts';
import type { Store } from '../store.ts';
import { layerColors, themed } from './colors.ts';
import { isHatched } from './hatching.ts';
import {
  type ClassLayer,
  type HeatLayer,
  legendClasses,
  NOT_ASKED_CLASS,
  type RampLayer,
  reasonInWords,
  TIMES_SEEN,
} from './layers.ts';
import { quantity } from './quantity.ts';
import type { LayerState } from './state.ts';
import type { Spread } from './statistics.ts';

export function Legend({ store }: { store: Store }) {
  if (store.marking.value.kind !== 'none') return <MarkLegend store={store} />;
  if (store.cloud.value.kind !== 'none' || isKeyOpen(store)) return <CloudLegend store={store} />;
  return <LayerLegend store={store} state={store.layerState.value} isDark={store.isDark.value} />;
}

/** Where all clouds are switched off by the key, the key has to stay. */
function isKeyOpen({ showClouds, hiddenClouds }: Store): boolean {
  return showClouds.value && hiddenClouds.value.size > 0;
}

/** What is highlighted, and how much it is. */
function MarkLegend({ store }: { store: Store }) {
  const marking = store.marking.value;
  const pair = store.pair.value;
  const plan = store.loaded.value?.plan;
  const about =
    pair !== null
      ? t('Seen from both {a} and {b}', { a: pair[0], b: pair[1] })
      : store.unseenFocus.value !== null
        ? t('Unseen: {reason}', { reason: reasonInWords(store.unseenFocus.value.surface.reason) })
        : plan === undefined
          ? ''
          : lossLegend(plan, store.stationId.value ?? '', store.ownRequirement.value);
  return (
    <figure class="legend" aria-label={t('Legend')} data-testid="legend" data-state={marking.kind}>
      {marking.kind === 'failed' && <p class="note note-warn">{marking.message}</p>}
      {marking.kind === 'loading' && <p class="muted">{t('Loading …')}</p>}
      {marking.kind === 'shown' && (
        <ul class="legend-classes">
          <li>
            <Swatch color={(store.isDark.value ? DARK : LIGHT).mark} />
            {about} <span class="muted">{areaWords(marking.areaM2)}</span>
          </li>
        </ul>
      )}
    </figure>
  );
}

interface ColorsProps {
  readonly layer: HeatLayer;
  readonly spread: Spread | null;
  readonly isDark: boolean;
  /** Something need not be covered. */
  readonly hasNotAsked: boolean;
}

function LayerLegend({ store, state, isDark }: { store: Store; state: LayerState; isDark: boolean }) {
  if (state.kind === 'none') return null;
  const hasNotAsked = store.loaded.value !== null && store.loaded.value.scope !== null;
  return (
    <figure class="legend" aria-label={t('Legend')} data-testid="legend" data-state={state.kind}>
      {state.kind === 'failed' ? (
        <p class="note note-warn">{state.message}</p>
      ) : (
        <>
          <figcaption>{state.layer.title}</figcaption>
          {state.kind === 'loading' && <p class="muted">{t('Loading …')}</p>}
          {state.kind === 'shown' && <Colors {...state} isDark={isDark} hasNotAsked={hasNotAsked} />}
          {state.kind === 'shown' && state.layer.id === DIFFERENCE_ID && <ChangesLegend store={store} />}
        </>
      )}
    </figure>
  );
}

function Colors({ layer, spread, ...how }: ColorsProps) {
  if (layer.kind === 'classes') return <Classes layer={layer} {...how} />;
  return spread === null ? null : <Ramp layer={layer} spread={spread} {...how} />;
}

interface ClassesProps {
  readonly layer: ClassLayer;
  readonly isDark: boolean;
  readonly hasNotAsked: boolean;
}

function Classes({ layer, isDark, hasNotAsked }: ClassesProps) {
  const classes = legendClasses(layer, hasNotAsked);
  return (
    <ul class={classes.length > 7 ? 'legend-classes legend-columns' : 'legend-classes'}>
      {classes.map(({ value, label, color }) => (
        <li key={value}>
          <Swatch
            color={themed(color, isDark)}
            hatch={layer.id === TIMES_SEEN && value === 0 ? hatchOf(isDark) : null}
          />
          {label}
        </li>
      ))}
    </ul>
  );
}

const UNSEEN = '#e8833a';

/** The lines over what no station sees, where it is hatched. */
const hatchOf = (isDark: boolean): string | null => (isHatched.value ? (isDark ? DARK : LIGHT).section : null);

interface RampProps {
  readonly layer: RampLayer;
  readonly spread: Spread;
  readonly isDark: boolean;
  readonly hasNotAsked: boolean;
}

function Ramp({ layer, spread, isDark, hasNotAsked }: RampProps) {
  const { low, high, median, mostly } = spread;
  return (
    <>
      <RampBar colors={layerColors(layer, isDark)} />
      <div class="legend-ends">
        <span>{quantity(low, layer.unit, high)}</span>
        <span>{quantity((low + high) / 2, layer.unit, high)}</span>
        <span>{quantity(high, layer.unit, high)}</span>
      </div>
      {median !== null && mostly !== null ? (
        <p class="muted" data-testid="spread">
          {t('Seen surface: median {median}, 95 % within {mostly}', {
            median: quantity(median, layer.unit),
            mostly: quantity(mostly, layer.unit),
          })}
        </p>
      ) : (
        <p class="muted">{t('No surface has a value.')}</p>
      )}
      <ul class="legend-classes">
        <li>
          <Swatch color={UNSEEN} hatch={hatchOf(isDark)} />
          {t('unseen')}
        </li>
        <li>
          <i class="swatch swatch-none" />
          {t('not scannable, or unknown')}
        </li>
        {hasNotAsked && (
          <li>
            <Swatch color={themed(NOT_ASKED_CLASS.color, isDark)} />
            {NOT_ASKED_CLASS.label}
          </li>
        )}
      </ul>
    </>
  );
}

/** A bar of 32 steps of a layer's 256 colours. */
export function RampBar({ colors }: { colors: Uint8Array }) {
  const steps = [...Array(32).keys()].map((i) => Math.round((i * 255) / 31));
  return (
    <svg
      class="legend-ramp"
      viewBox="0 0 32 1"
      preserveAspectRatio="none"
      shape-rendering="crispEdges"
      aria-hidden="true"
    >
      {steps.map((at, i) => (
        <rect key={at} x={i} width="1.1" height="1" fill={`rgb(${colors.subarray(3 * at, 3 * at + 3).join(' ')})`} />
      ))}
    </svg>
  );
}

export function Swatch({ color, hatch = null }: { color: string; hatch?: string | null }) {
  return (
    <svg class="swatch" viewBox="0 0 14 14" aria-hidden="true">
      <rect width="14" height="14" fill={color} />
      {hatch !== null && <path d="M0 6 6 0M0 13 13 0M7 14l7-7" stroke={hatch} stroke-width="1.8" />}
    </svg>
  );
}

const CLOUD_TITLES = {
  range: t('Range of returns'),
  incidence: t('Incidence angle'),
  intensity: t('Intensity (bright: head-on)'),
  station: t('Points by station'),
} as const;
function CloudLegend({ store }: { store: Store }) {
  const paint = store.cloudPaint.value;
  const cloud = store.cloud.value;
  return (
    <figure class="legend" aria-label={t('Legend')} data-testid="legend" data-state={cloud.kind}>
      <figcaption>{CLOUD_TITLES[paint]}</figcaption>
      {paint === 'station' ? <StationColors store={store} /> : <CloudRamp store={store} />}
      {store.stationId.value === null && <CloudControl store={store} />}
    </figure>
  );
}

function CloudRamp({ store }: { store: Store }) {
  const paint = store.cloudPaint.value;
  const ends = {
    range: [lengthWords(0, 0), quantity(store.cloudFarthestM.value, 'm')],
    incidence: [t('90°, grazing'), t('0°, head-on')],
    intensity: [t('grazing'), t('head-on')],
    station: [],
  }[paint];
  const grey = Uint8Array.from({ length: 768 }, (_, i) => 38 + Math.round((217 * Math.floor(i / 3)) / 255));
  return (
    <>
      <RampBar colors={paint === 'intensity' ? grey : rampBytes()} />
      <div class="legend-ends">
        {ends.map((end) => (
          <span key={end}>{end}</span>
        ))}
      </div>
    </>
  );
}

function StationColors({ store }: { store: Store }) {
  const floorId = store.floorId.value;
  const isShown = ({ id, floorId: own }: ShownStation): boolean =>
    store.showClouds.value ? floorId === null || own === floorId : id === store.stationId.value;
  const stations = store.shownStations.value.filter(isShown);
  const hidden = store.hiddenClouds.value;
  const mayHide = store.showClouds.value;
  const showOnly = (isShownNow: (id: string) => boolean): void => {
    const here = new Set(stations.map(({ id }) => id));
    const elsewhere = [...hidden].filter((id) => !here.has(id));
    store.hiddenClouds.value = new Set([...elsewhere, ...[...here].filter((id) => !isShownNow(id))]);
  };
  return (
    <>
      {mayHide && stations.length > 1 && (
        <p class="cloud-key-all">
          <button type="button" class="link" onClick={() => showOnly(() => true)}>
            {t('All')}
          </button>
          <button type="button" class="link" onClick={() => showOnly(() => false)}>
            {t('None')}
          </button>
        </p>
      )}
      <ul class="legend-classes cloud-key" aria-label={t('Clouds by station')}>
        {stations.map(({ id, order }) => (
          <li key={id} class={hidden.has(id) ? 'cloud-key-off' : ''}>
            {mayHide ? (
              <label>
                <input
                  type="checkbox"
                  checked={!hidden.has(id)}
                  onChange={(event) => {
                    const isOn = event.currentTarget.checked;
                    showOnly((other) => (other === id ? isOn : !hidden.has(other)));
                  }}
                />
                <Swatch color={cssColor(stationColor(order))} />
                {id}
              </label>
            ) : (
              <>
                <Swatch color={cssColor(stationColor(order))} />
                {id}
              </>
            )}
          </li>
        ))}
      </ul>
    </>
  );
}
