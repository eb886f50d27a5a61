/** Over the picture while walking: the floor one is on, its stations, and where one stands and looks; a click goes there. */
import { useSignal } from '@preact/signals';
import { useEffect, useMemo, useRef } from 'preact/hooks';
import { groundOf, wallsOf } from '../field/floor-map.tsx';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { Stage, StageFloor } from '../load/stage.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { floorAt, type MapWindow, mapWindow } from './map-window.ts';
import './walk-map.css';
import type { WalkPose } from './walker.ts';

interface MapProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly view: PlanView;
}

export function WalkMap({ store, loaded, view }: MapProps) {
  const pose = view.walk.where.value;
  // Local frame: coordinates of a site are too large for the precision of a drawing.
  const stage = useMemo((): Stage => ({ ...loaded.stage, offsetM: [0, 0, 0] }), [loaded]);
  if (pose === null) return null;
  const below = view.walk.floorBelow(pose);
  const floor = stage.floors.find(({ id }) => id === below) ?? floorAt(pose.eyeM[2] - pose.eyeHeightM, stage.floors);
  if (floor === undefined) return null;
  return <FloorOf {...{ store, stage, view, pose, floor }} />;
}

interface FloorProps extends Omit<MapProps, 'loaded'> {
  readonly stage: Stage;
  readonly pose: WalkPose;
  readonly floor: StageFloor;
}

function FloorOf({ store, stage, view, pose, floor }: FloorProps) {
  const drawing = useRef<SVGSVGElement>(null);
  const isRefused = useSignal(false);
  const ground = useMemo(() => groundOf(stage, floor.id).path, [stage, floor]);
  const walls = useMemo(() => wallsOf(stage, floor.id), [stage, floor]);
  useEffect(() => {
    isRefused.value = false;
  }, [pose, isRefused]);
  const extents = store.extents.value;
  const extent = extents?.grounds.get(floor.id) ?? extents?.whole;
  if (extent === undefined) return null;
  const shown = mapWindow(extent, pose.eyeM);
  const go = (event: MouseEvent): void => {
    const toPage = drawing.current?.getScreenCTM();
    if (!toPage) return;
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(toPage.inverse());
    isRefused.value = !view.walk.goOnMap(x, -y, floor.elevationM);
  };
  return (
    <figure class="walk-map" data-floor={floor.id}>
      {/* biome-ignore lint/a11y/useKeyWithClickEvents: keys walk. */}
      <svg
        ref={drawing}
        viewBox={`${shown.x} ${shown.y} ${shown.width} ${shown.height}`}
        role="img"
        aria-label={t('Map of the floor')}
        onClick={go}
      >
        <path class="map-ground" d={ground} />
        <path class="map-walls" d={walls} />
        <Marks store={store} floorId={floor.id} pose={pose} shown={shown} />
      </svg>
      <figcaption>
        {!isRefused.value && floor.name}
        <span role="status" class="walk-map-refused">
          {isRefused.value && t('Nobody can stand there.')}
        </span>
      </figcaption>
    </figure>
  );
}

/** Of a dot, and of how far one sees: shares of the map's longer side. */
const [DOT, SIGHT] = [0.034, 0.2];
/** Half of what is seen at once, as the camera has it while walking. */
const HALF_SIGHT_RAD = 0.54;

function Marks({
  store,
  floorId,
  pose,
  shown,
}: Record<'floorId', string> & { store: Store; pose: WalkPose; shown: MapWindow }) {
  const metres = Math.max(shown.width, shown.height);
  const [dot, sight] = [DOT * metres, SIGHT * metres];
  const [x, y] = pose.eyeM;
  const [cos, sin] = [sight * Math.cos(HALF_SIGHT_RAD), sight * Math.sin(HALF_SIGHT_RAD)];
  const turn = (-pose.headingRad * 180) / Math.PI;
  return (
    <>
      {store.shownStations.value
        .filter((station) => station.floorId === floorId)
        .map(({ id, number, positionM: [atX, atY] }) => (
          <g key={id} class="walk-map-station" transform={`translate(${atX} ${-atY})`}>
            <circle r={dot} />
            <text font-size={1.15 * dot}>{number}</text>
          </g>
        ))}
      <g
        class="walk-map-me"
        data-testid="walk-map-me"
        transform={`translate(${x.toFixed(3)} ${(-y).toFixed(3)}) rotate(${turn.toFixed(1)})`}
      >
        <path class="walk-map-sight" d={`M0 0L${cos} ${-sin}A${sight} ${sight} 0 0 1 ${cos} ${sin}Z`} />
        <path
          d={`M${1.7 * dot} 0L${-1.1 * dot} ${1.1 * dot}L${-0.6 * dot} 0L${-1.1 * dot} ${-1.1 * dot}Z`}
          stroke-width={dot / 3}
        />
      </g>
    </>
  );
}
