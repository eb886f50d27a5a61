/** What is drawn over the building: measurements, the next point, the grid of the plan view, distances to walls, the section box. */
import { useComputed, useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { localOf } from '../edit/draft.ts';
import { sliceOfFloor } from '../floors/cut.ts';
import { BoxFrame, BoxHandles } from '../section/box-handles.tsx';
import { isKept } from '../section/planes.ts';
import { SightLines } from '../sights/sight-lines.tsx';
import type { Store } from '../store.ts';
import type { PointM } from './geometry.ts';
import { listenToMeasureKeys } from './keys.ts';
import './measure.css';
import { Measurer } from './measurer.ts';
import { PlanGrid } from './plan-grid.tsx';
import { SetUpLines } from './set-up-lines.tsx';
import type { MeasureKind, MeasurePoint, SiteTool } from './state.ts';
import { inSvg, Label, type LayerProps, Lines, type Place } from './svg-parts.tsx';
import { resultOf } from './words.ts';

export function MeasureLayer({ store, loaded, view }: LayerProps) {
  const frame = useSignal(0);
  const hasLines = useComputed(() => isDrawn(store));
  useEffect(() => {
    const measurer = new Measurer(store, loaded, view);
    store.measuring.measurer.value = measurer;
    const stopKeys = listenToMeasureKeys(window, store, measurer);
    const stopFrames = view.onFrame(() => {
      if (hasLines.peek()) frame.value++;
    });
    return () => {
      stopFrames();
      stopKeys();
      store.measuring.measurer.value = null;
      measurer.dispose();
    };
  }, [store, loaded, view]);
  if (!hasLines.value) return null;
  // What is drawn follows the camera, frame by frame: also where nothing else changes, so parts are told the frame.
  const place = (sceneM: PointM, floorId: string): Place | null => {
    const localM = localOf(sceneM, loaded.stage.offsetM);
    const slice = sliceOfFloor(store.slices.value, floorId);
    return slice === undefined || !isKept(slice.planes ?? [], localM, 0.01) ? null : view.project(localM, floorId);
  };
  const { measuring, isWalking } = store;
  const [tool, points, next] = [measuring.tool.value, measuring.points.value, measuring.next.value];
  return (
    <div class="measure-layer">
      <svg aria-hidden="true">
        {store.isPlanView.value && !isWalking.value && <PlanGrid loaded={loaded} view={view} frame={frame.value} />}
        {store.sectionBox.value !== null && !isWalking.value && (
          <BoxFrame box={store.sectionBox.value} view={view} frame={frame.value} />
        )}
        <SetUpLines store={store} loaded={loaded} view={view} place={place} frame={frame.value} />
        <SightLines store={store} loaded={loaded} view={view} place={place} frame={frame.value} />
        {measuring.done.value.map((one) => (
          <Drawn key={one.id} {...one} place={place} isDone={true} />
        ))}
        {tool !== null && (
          <Drawn
            kind={tool}
            points={next === null ? points : [...points, next]}
            place={place}
            isDone={false}
            isInPlan={store.isPlanView.value}
            nTaken={points.length}
          />
        )}
        {next !== null && tool !== null && <Mark point={next} at={place(next.sceneM, next.floorId)} />}
        {measuring.cursor.value !== null && tool !== null && <Crosshair {...measuring.cursor.value} />}
      </svg>
      {store.sectionBox.value !== null && !isWalking.value && (
        <BoxHandles store={store} box={store.sectionBox.value} view={view} frame={frame.value} />
      )}
    </div>
  );
}

function isDrawn({ measuring, isPlanView, sectionBox, sights }: Store): boolean {
  const { tool, done, showsSetUp } = measuring;
  const isAnyDrawn = tool.value !== null || done.value.length > 0;
  return (
    isAnyDrawn || showsSetUp.value || sights.value.kind === 'shown' || isPlanView.value || sectionBox.value !== null
  );
}

interface DrawnProps {
  readonly kind: SiteTool;
  readonly points: readonly MeasurePoint[];
  readonly place: (sceneM: PointM, floorId: string) => Place | null;
  readonly isDone: boolean;
  readonly isInPlan: boolean;
  /** Of the points, those that are taken: the last one may follow the pointer. */
  readonly nTaken?: number;
}

const LEAST_POINTS: Readonly<Record<SiteTool, number>> = {
  distance: 2,
  height: 2,
  angle: 3,
  area: 3,
  section: 2,
  surface: 2,
};

function Drawn({ kind, points, place, isDone, isInPlan, nTaken = points.length }: DrawnProps) {
  const places = points.map(({ sceneM, floorId }) => place(sceneM, floorId));
  if (points.length === 0 || places.includes(null)) return null;
  const shown = places as readonly Place[];
  const isTold = points.length >= LEAST_POINTS[kind] && kind !== 'section';
  const label = isTold ? resultOf({ kind: kind as MeasureKind, points, isInPlan }).main : null;
  const at = labelPlace(kind, shown);
  const path = kind === 'height' && points.length === 2 ? heightPath(points, place) : shown;
  return (
    <g class={isDone ? 'measured' : 'measured measured-under-way'}>
      {kind === 'area' && shown.length >= 3 && <polygon points={inSvg(shown)} />}
      <Lines places={kind === 'area' && isDone ? [...shown, shown[0]] : path} />
      {shown.slice(0, nTaken).map((p, i) => (
        <circle key={`${points[i].sceneM}`} cx={p.x} cy={p.y} r="4" />
      ))}
      {label !== null && <Label x={at.x} y={at.y} words={label} />}
    </g>
  );
}

/** Straight up or down from the first point, then level to the second. */
function heightPath(
  [{ sceneM: from, floorId }, to]: readonly MeasurePoint[],
  place: DrawnProps['place'],
): readonly Place[] {
  const corner = place([from[0], from[1], to.sceneM[2]], floorId);
  const ends = [place(from, floorId), corner, place(to.sceneM, to.floorId)];
  return ends.filter((one) => one !== null);
}

/** Which point is meant: a square on a corner, a cross on an edge, a dot on a surface. */
function Mark({ point, at }: { point: MeasurePoint; at: Place | null }) {
  if (at === null) return null;
  return (
    <g class="measure-mark" data-on={point.on}>
      {point.on === 'corner' && <rect x={at.x - 7} y={at.y - 7} width="14" height="14" />}
      {point.on === 'edge' && (
        <path d={`M${at.x - 7} ${at.y - 7}L${at.x + 7} ${at.y + 7}M${at.x - 7} ${at.y + 7}L${at.x + 7} ${at.y - 7}`} />
      )}
      <circle cx={at.x} cy={at.y} r="3" />
    </g>
  );
}

function Crosshair({ x, y }: Place) {
  const d = `M${x - 22} ${y}H${x - 6}M${x + 6} ${y}H${x + 22}M${x} ${y - 22}V${y - 6}M${x} ${y + 6}V${y + 22}`;
  return (
    <g class="measure-crosshair">
      <path class="measured-case" d={d} />
      <path d={d} />
    </g>
  );
}

function labelPlace(kind: SiteTool, places: readonly Place[]): Place {
  if (kind === 'angle' && places.length >= 2) return { x: places[1].x, y: places[1].y - 16 };
  const used = kind === 'area' ? places : places.slice(-2);
  const sum = used.reduce((a, b) => ({ x: a.x + b.x, y: a.y + b.y }));
  const above = kind === 'area' ? 0 : -12;
  return { x: sum.x / used.length, y: sum.y / used.length + above };
}
