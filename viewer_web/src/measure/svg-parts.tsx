/** Lines and labels over the picture, as all that measures draws them. */
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

export interface LayerProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly view: PlanView;
}

/** Counts pictures: parts whose other properties stay the same are drawn anew with each. */
export interface Framed {
  readonly frame: number;
}

export interface Place {
  readonly x: number;
  readonly y: number;
}

/** Twice: a light line under a dark one is seen on any ground. */
export function Lines({ places, name = '' }: { places: readonly Place[]; name?: string }) {
  return (
    <>
      <polyline class="measured-case" points={inSvg(places)} />
      <polyline class={name} points={inSvg(places)} />
    </>
  );
}

export function Label({ x, y, words }: { x: number; y: number; words: string }) {
  return (
    <text x={x} y={y} text-anchor="middle" dominant-baseline="central">
      {words}
    </text>
  );
}

export const inSvg = (places: readonly Place[]): string =>
  places.map(({ x, y }) => `${x.toFixed(1)},${y.toFixed(1)}`).join(' ');
