/** What the chosen station sees, as a picture of all around; a click looks there from the station. */

import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { quantity } from '../heat/quantity.ts';
import { t } from '../language/language.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { BeamFinder, type Direction, directionAt, frameOf, panoramaPixels } from './panorama-image.ts';
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
  useEffect(() => {
    const context = canvas.current?.getContext('2d');
    if (!context || chosen === null || frame === null) return;
    const pixels = panoramaPixels(chosen, frame, colorBy(paint, farthestM, order));
    context.putImageData(new ImageData(pixels, frame.width, frame.height), 0, 0);
  }, [chosen, frame, paint, farthestM, order]);
  if (chosen === null || frame === null || finder === null) {
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
  const describe = (direction: Direction): string => {
    const beam = finder.beamAt(direction);
    const steps = beam < 0 ? 0 : chosen.cloud.rangeSteps[beam];
    if (steps === 0) return t('No return');
    const incidence = (Math.acos(chosen.cloud.intensity[beam] / 255) * 180) / Math.PI;
    return t('Range {range}, incidence {incidence}', {
      range: quantity(steps * chosen.beams.rangeStepM, 'm'),
      incidence: quantity(incidence, 'deg'),
    });
  };
  return (
    <div class="panorama">
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
