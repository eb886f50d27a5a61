/** In the plan view: a grid along the axes of the scene, a scale bar, and which way north is. */

import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { plain, t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { FOOT_M, units } from '../panels/units.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { multiples, roundStepM, stepWords } from './ruler.ts';
import { northOf } from './site.ts';
import type { Framed } from './svg-parts.tsx';

/** Lines nearer to each other than this hide the plan. */
const GRID_PIXELS = 80;
const BAR_PIXELS = 60;

export function PlanGrid({ loaded, view }: Framed & { loaded: LoadedPlan; view: PlanView }) {
  const { left, top, right, bottom } = view.box;
  const { floors, offsetM } = loaded.stage;
  const floorId = floors[0]?.id ?? '';
  const [from, to] = [view.levelAt(left, bottom, floorId, 0), view.levelAt(right, top, floorId, 0)];
  if (from === null || to === null) return null;
  const [width, height] = [right - left, bottom - top];
  const stepM = roundStepM((GRID_PIXELS * (to[0] - from[0])) / width, units.value);
  const unitM = units.value === 'm' ? 1 : FOOT_M;
  const words = (m: number): string => plain(Number((m / unitM).toFixed(3)));
  const x = (m: number): number => ((m - from[0] - offsetM[0]) / (to[0] - from[0])) * width;
  const y = (m: number): number => height - ((m - from[1] - offsetM[1]) / (to[1] - from[1])) * height;
  return (
    <g class="plan-grid" data-testid="plan-grid" data-step={stepWords(stepM, units.value)}>
      {multiples(stepM, from[0] + offsetM[0], to[0] + offsetM[0]).map((m) => (
        <g key={m}>
          <line x1={x(m)} x2={x(m)} y1="0" y2={height} />
          <text x={x(m) + 3} y={height - 3}>
            {words(m)}
          </text>
        </g>
      ))}
      {multiples(stepM, from[1] + offsetM[1], to[1] + offsetM[1]).map((m) => (
        <g key={m}>
          <line x1="0" x2={width} y1={y(m)} y2={y(m)} />
          <text x={width - 3} y={y(m) - 3} text-anchor="end">
            {words(m)}
          </text>
        </g>
      ))}
    </g>
  );
}

/** Beside the legend, where nothing lies over it. */
export function PlanScale({ store, view }: { store: Store; view: PlanView }) {
  const metresPerPixel = useSignal(1);
  useEffect(
    () =>
      view.onFrame(() => {
        const now = view.metresPerPixel();
        if (Math.abs(now / metresPerPixel.peek() - 1) > 1e-4) metresPerPixel.value = now;
      }),
    [view],
  );
  const loaded = store.loaded.value;
  const isFacing = store.isFacing.value && store.sectionLine.value !== null;
  if (!(store.isPlanView.value || isFacing) || store.isWalking.value || loaded === null) return null;
  const metres = metresPerPixel.value;
  const stepM = roundStepM(BAR_PIXELS * metres, units.value);
  const pixels = stepM / metres;
  return (
    <figure class="legend plan-scale" aria-label={t('Scale')} data-testid="plan-scale">
      <svg
        width={pixels + 2}
        height="12"
        role="img"
        aria-label={t('Scale bar of {length}', { length: stepWords(stepM, units.value) })}
      >
        <path d={`M1 2V10M1 6H${pixels + 1}M${pixels + 1} 2V10`} />
      </svg>
      <span data-testid="scale-words" data-pixels={pixels.toFixed(2)}>
        {stepWords(stepM, units.value)}
      </span>
      {!isFacing && <North scene={loaded.plan.scene} />}
    </figure>
  );
}

function North({ scene }: { scene: PlanJson['scene'] }) {
  const { rad, name } = northOf(scene);
  const degrees = Number(((rad * 180) / Math.PI).toFixed(1));
  return (
    <>
      <svg
        class="plan-north"
        width="28"
        height="28"
        viewBox="-14 -14 28 28"
        role="img"
        aria-label={t('{name}, {degrees}° clockwise from up', { name, degrees: plain(degrees) })}
      >
        <g transform={`rotate(${degrees})`}>
          <path class="plan-north-arrow" d="M0 -12L5 9L0 5L-5 9Z" />
        </g>
      </svg>
      <span>{name}</span>
    </>
  );
}
