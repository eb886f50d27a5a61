/** What the colours mean: of the layer the building is painted by, or of the clouds where they are shown. */
import { metres, squareMetres } from '../panels/figures.ts';
import { DARK, LIGHT } from '../scene/palette.ts';
import type { LayerState, Store } from '../store.ts';
import { layerColors, themed } from './colors.ts';
import type { ClassLayer, HeatLayer, RampLayer } from './layers.ts';
import { quantity } from './quantity.ts';
import type { Spread } from './statistics.ts';

export function Legend({ store }: { store: Store }) {
  if (store.marking.value.kind !== 'none') return <MarkLegend store={store} />;
  if (store.cloud.value.kind === 'shown') return <CloudLegend store={store} />;
  return <LayerLegend state={store.layerState.value} isDark={store.isDark.value} />;
}

/** What is pointed out, and how much it is. */
function MarkLegend({ store }: { store: Store }) {
  const marking = store.marking.value;
  const pair = store.pair.value;
  const about =
    pair !== null
      ? `Seen by both ${pair[0]} and ${pair[1]}`
      : store.unseenFocus.value !== null
        ? `Unseen: ${store.unseenFocus.value.surface.reason}`
        : `Seen by ${store.stationId.value} alone`;
  return (
    <figure class="legend" aria-label="Legend" data-testid="legend" data-state={marking.kind}>
      {marking.kind === 'failed' && <p class="note note-warn">{marking.message}</p>}
      {marking.kind === 'loading' && <p class="muted">Loading …</p>}
      {marking.kind === 'shown' && (
        <ul class="legend-classes">
          <li>
            <Swatch color={(store.isDark.value ? DARK : LIGHT).mark} />
            {about}
            <span class="muted">{squareMetres(marking.areaM2)}</span>
          </li>
        </ul>
      )}
    </figure>
  );
}

function LayerLegend({ state, isDark }: { state: LayerState; isDark: boolean }) {
  if (state.kind === 'none') return null;
  return (
    <figure class="legend" aria-label="Legend" data-testid="legend" data-state={state.kind}>
      {state.kind === 'failed' ? (
        <p class="note note-warn">{state.message}</p>
      ) : (
        <>
          <figcaption>{state.layer.title}</figcaption>
          {state.kind === 'loading' && <p class="muted">Loading …</p>}
          {state.kind === 'shown' && <Colors layer={state.layer} spread={state.spread} isDark={isDark} />}
        </>
      )}
    </figure>
  );
}

function Colors({ layer, spread, isDark }: { layer: HeatLayer; spread: Spread | null; isDark: boolean }) {
  if (layer.kind === 'classes') return <Classes layer={layer} isDark={isDark} />;
  return spread === null ? null : <Ramp layer={layer} spread={spread} isDark={isDark} />;
}

function Classes({ layer, isDark }: { layer: ClassLayer; isDark: boolean }) {
  return (
    <ul class={layer.classes.length > 7 ? 'legend-classes legend-columns' : 'legend-classes'}>
      {layer.classes.map(({ value, label, color }) => (
        <li key={value}>
          <Swatch color={themed(color, isDark)} />
          {label}
        </li>
      ))}
    </ul>
  );
}

const UNSEEN = '#e8833a';

function Ramp({ layer, spread, isDark }: { layer: RampLayer; spread: Spread; isDark: boolean }) {
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
          Half of what is seen: up to {quantity(median, layer.unit)}; 95 %: up to {quantity(mostly, layer.unit)}
        </p>
      ) : (
        <p class="muted">No surface has a value.</p>
      )}
      <ul class="legend-classes">
        <li>
          <Swatch color={UNSEEN} />
          unseen
        </li>
        <li>
          <i class="swatch swatch-none" />
          not achievable, or not known
        </li>
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
      shapeRendering="crispEdges"
      aria-hidden="true"
    >
      {steps.map((at, i) => (
        <rect key={at} x={i} width="1.1" height="1" fill={`rgb(${colors.subarray(3 * at, 3 * at + 3).join(' ')})`} />
      ))}
    </svg>
  );
}

export function Swatch({ color }: { color: string }) {
  return (
    <svg class="swatch" viewBox="0 0 14 14" aria-hidden="true">
      <rect width="14" height="14" fill={color} />
    </svg>
  );
}

function CloudLegend({ store }: { store: Store }) {
  const rangeMaxM = store.loaded.value?.plan.scanner.range_max_m ?? 0;
  const isRange = store.cloudPaint.value === 'range';
  return (
    <figure class="legend" aria-label="Legend">
      <figcaption>{isRange ? 'Range of the return' : 'Incidence: bright is head-on'}</figcaption>
      <div class={isRange ? 'legend-ramp legend-range' : 'legend-ramp legend-intensity'} />
      <div class="legend-ends">
        <span>{isRange ? metres(0, 0) : 'grazing'}</span>
        <span>{isRange ? metres(rangeMaxM, 0) : 'head-on'}</span>
      </div>
    </figure>
  );
}
