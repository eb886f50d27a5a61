/** What the chosen station sees, all around at once or one way; a click looks there from the station. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { quantity } from '../heat/quantity.ts';
import { t } from '../language/language.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { LookAround } from './look-around.tsx';
import { BeamFinder, type Direction, directionAt, frameOf, panoramaPixels } from './panorama-image.ts';
import { firstLook } from './panorama-look.ts';
import { rampRgb } from './range-ramp.ts';
import type { CloudPaint } from './state.ts';
import { stationColor } from './station-color.ts';

/** Enough for the widest screens the sheet fills. */
const WIDTH = 1600;

export function Panorama({ store, view }: { store: Store; view: PlanView | null }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [words, setWords] = useState('');
  const chosen = store.chosenCloud.value;
  const off = whyNoPicture(store);
  const [paint, farthestM] = [store.cloudPaint.value, store.cloudFarthestM.value];
  const order = store.shownStations.value.find(({ id }) => id === chosen?.stationId)?.order ?? 0;
  const frame = useMemo(() => (chosen === null ? null : frameOf(chosen.beams, WIDTH)), [chosen]);
  const finder = useMemo(() => (chosen === null ? null : new BeamFinder(chosen.beams)), [chosen]);
  const pixels = useMemo(
    () => chosen && frame && panoramaPixels(chosen, frame, colorBy(paint, farthestM, order)),
    [chosen, frame, paint, farthestM, order],
  );
  const look = store.panoramaLook.value;
  useEffect(() => {
    const context = canvas.current?.getContext('2d');
    if (!context || pixels === null || frame === null) return;
    context.putImageData(new ImageData(pixels, frame.width, frame.height), 0, 0);
  }, [pixels, frame, look === null]);
  if (chosen === null || frame === null || finder === null || pixels === null) {
    return (
      <p class="muted">{store.cloud.value.kind === 'loading' ? t('Loading the cloud …') : t('No station selected.')}</p>
    );
  }
  const at = (event: MouseEvent): Direction => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const share = (from: number, size: number): number => Math.min(1, Math.max(0, from / size));
    const x = share(event.clientX - box.left, box.width) * frame.width;
    const y = share(event.clientY - box.top, box.height) * frame.height;
    return directionAt(frame, x - 0.5, y - 0.5);
  };
  const rangeOf = (beam: number): number => chosen.cloud.rangeSteps[beam] * chosen.beams.rangeStepM;
  const rangeIn = (direction: Direction): number => {
    const beam = finder.beamAt(direction);
    return beam < 0 ? 0 : rangeOf(beam);
  };
  const describe = (direction: Direction): string => {
    const beam = finder.beamAt(direction);
    const rangeM = rangeIn(direction);
    if (rangeM === 0) return t('No return');
    const incidence = (Math.acos(chosen.cloud.intensity[beam] / 255) * 180) / Math.PI;
    return t('Range {range}, incidence {incidence}', {
      range: quantity(rangeM, 'm'),
      incidence: quantity(incidence, 'deg'),
    });
  };
  return (
    <div class={look === null ? 'panorama' : 'panorama panorama-look'}>
      <div class="segments segments-flat" role="radiogroup" aria-label={t('Picture of the panorama')}>
        {[false, true].map((isLook) => (
          // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
          <button
            key={String(isLook)}
            type="button"
            role="radio"
            aria-checked={isLook === (look !== null)}
            onClick={() => {
              store.panoramaLook.value = isLook ? (look ?? firstLook(frame, rangeIn)) : null;
            }}
          >
            {isLook ? t('Look around') : t('All around')}
          </button>
        ))}
      </div>
      {look === null ? (
        <>
          <canvas
            ref={canvas}
            width={frame.width}
            height={frame.height}
            role="img"
            aria-label={t('Panorama of station {id}', { id: chosen.stationId })}
            onPointerMove={(event) => setWords(describe(at(event)))}
            onPointerLeave={() => setWords('')}
            onClick={(event) => {
              if (off !== null) return;
              view?.lookFrom(chosen.stationId, at(event));
              store.sheet.value = null;
            }}
          />
          <Compass leftRad={frame.leftRad} spanRad={frame.spanRad} />
        </>
      ) : (
        <LookAround
          {...{ store, look, frame, rangeIn }}
          stationId={chosen.stationId}
          panorama={pixels}
          onPoint={(direction) => setWords(direction === null ? '' : describe(direction))}
          onChoose={(direction) => view?.lookFrom(chosen.stationId, direction)}
        />
      )}
      <p class="muted" aria-live="polite">
        {words ||
          (off === null
            ? t('Point to read the range; click to look that way from the station.')
            : t('Point to read the range.'))}
      </p>
    </div>
  );
}

/** Where the axes of the scene lie. */
function Compass({ leftRad, spanRad }: { leftRad: number; spanRad: number }) {
  const axes: [string, number][] = [
    ['x', 0],
    ['y', 0.5 * Math.PI],
    ['−x', Math.PI],
    ['−y', 1.5 * Math.PI],
  ];
  const turn = 2 * Math.PI;
  return (
    <svg class="compass" aria-hidden="true">
      {axes.map(([name, azimuth]) => {
        const share = ((((leftRad - azimuth) % turn) + turn) % turn) / spanRad;
        return share <= 1 ? (
          <text key={name} x={`${Math.min(98.5, Math.max(1.5, 100 * share))}%`} y="13" text-anchor="middle">
            {name}
          </text>
        ) : null;
      })}
    </svg>
  );
}

function colorBy(paint: CloudPaint, farthestM: number, order: number) {
  const own = stationColor(order).map((x) => 255 * x);
  return (rangeM: number, intensity: number): readonly [number, number, number] => {
    // Shaded by incidence too: edges of rooms and furniture are lost in ranges alone.
    const shade = 0.55 + 0.45 * intensity;
    if (paint === 'intensity')
      return [255, 255, 255].map((x) => x * (0.15 + 0.85 * intensity)) as [number, number, number];
    if (paint === 'station') return own.map((x) => x * shade) as [number, number, number];
    if (paint === 'incidence') return rampRgb(1 - Math.acos(Math.min(1, intensity)) / (Math.PI / 2));
    return rampRgb(rangeM / farthestM).map((x) => x * shade) as [number, number, number];
  };
}
