/** The section box over the picture: its edges, and a handle on each side that drags it, by pointer or by arrow keys. */

import { Vector3 } from 'three';
import { t } from '../language/language.ts';
import type { Framed } from '../measure/svg-parts.tsx';
import { lengthWords } from '../panels/figures.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { BOX_SIDES, type BoxSide, type PointM, type SectionBox, withSide } from './planes.ts';

const SIDE_NAMES: Readonly<Record<string, string>> = {
  '0 min': t('West'),
  '0 max': t('East'),
  '1 min': t('South'),
  '1 max': t('North'),
  '2 min': t('Bottom'),
  '2 max': t('Top'),
};
export const sideName = ({ axis, end }: BoxSide): string => SIDE_NAMES[`${axis} ${end}`];

const KEY_STEP_M = 0.1;
/** A side that moves less in the picture than this for a metre can't be dragged there. */
const LEAST_PIXELS_A_METRE = 2;

interface BoxProps extends Framed {
  readonly box: SectionBox;
  readonly view: PlanView;
}

/** Local heights are drawn as they are: with a section the building is whole. */
const NO_FLOOR = '';

export function BoxFrame({ box, view }: BoxProps) {
  const corner = (i: number): PointM => [
    (i & 1 ? box.maxM : box.minM)[0],
    (i & 2 ? box.maxM : box.minM)[1],
    (i & 4 ? box.maxM : box.minM)[2],
  ];
  const places = [...Array(8).keys()].map((i) => view.project(corner(i), NO_FLOOR));
  const edges = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) =>
    [1, 2, 4].filter((bit) => (i & bit) === 0).map((bit) => [places[i], places[i | bit]] as const),
  );
  return (
    <g class="section-frame">
      {edges.map(([a, b], i) => a !== null && b !== null && <line key={i} x1={a.x} y1={a.y} x2={b.x} y2={b.y} />)}
    </g>
  );
}

export function BoxHandles({ store, box, view, frame }: BoxProps & { readonly store: Store }) {
  return (
    <>
      {BOX_SIDES.map((side) => (
        <Handle key={sideName(side)} store={store} box={box} view={view} side={side} frame={frame} />
      ))}
    </>
  );
}

function Handle({ store, box, view, side }: BoxProps & { readonly store: Store; readonly side: BoxSide }) {
  const { axis, end } = side;
  const place = handlePlace(box, side, view);
  if (place === null) return null;
  const atM = (end === 'min' ? box.minM : box.maxM)[axis];
  const sceneM = atM + (store.loaded.value?.stage.offsetM[axis] ?? 0);
  const put = (toM: number): void => {
    const now = store.sectionBox.peek();
    if (now !== null) store.sectionBox.value = withSide(now, side, toM);
  };
  return (
    <div
      class={`section-handle section-handle-${end}`}
      role="slider"
      tabIndex={0}
      aria-label={t('{side} side of the section box', { side: sideName(side) })}
      aria-orientation={axis === 0 ? 'horizontal' : 'vertical'}
      aria-valuemin={-1e6}
      aria-valuemax={1e6}
      aria-valuenow={Number(sceneM.toFixed(3))}
      aria-valuetext={lengthWords(sceneM)}
      title={t('{side}: drag, or arrow keys', { side: sideName(side) })}
      style={{ transform: `translate(-50%, -50%) translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)` }}
      onPointerDown={(event) => {
        if (event.button !== 0) return;
        event.stopPropagation();
        drag(event, (dx, dy) => put(atM + (dx * place.way.x + dy * place.way.y) / place.way.lengthSq()));
      }}
      onKeyDown={(event) => {
        const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
        if (sign === undefined) return;
        event.preventDefault();
        event.stopPropagation();
        put(atM + sign * KEY_STEP_M * (event.shiftKey ? 10 : 1));
      }}
    />
  );
}

/** Where a side's handle is in the picture, and the way there that a metre of it is, in pixels; null: it can't be dragged from here. */
function handlePlace({ minM, maxM }: SectionBox, { axis, end }: BoxSide, view: PlanView) {
  const middle = minM.map((x, k) => (x + maxM[k]) / 2) as [number, number, number];
  middle[axis] = (end === 'min' ? minM : maxM)[axis];
  const further = [...middle] as [number, number, number];
  further[axis] += 1;
  const [at, to] = [view.project(middle, NO_FLOOR), view.project(further, NO_FLOOR)];
  if (at === null || to === null) return null;
  const way = new Vector3(to.x - at.x, to.y - at.y, 0);
  return way.length() < LEAST_PIXELS_A_METRE ? null : { ...at, way };
}

function drag(down: PointerEvent, onMove: (dx: number, dy: number) => void): void {
  const handle = down.currentTarget as HTMLElement;
  handle.setPointerCapture(down.pointerId);
  const over = new AbortController();
  const { signal } = over;
  handle.addEventListener(
    'pointermove',
    (event) => onMove(event.clientX - down.clientX, event.clientY - down.clientY),
    { signal },
  );
  for (const name of ['pointerup', 'pointercancel']) handle.addEventListener(name, () => over.abort(), { signal });
}
