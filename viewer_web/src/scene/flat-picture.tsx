/** In the place of the 3D picture where the browser shows none: the floors in plan, links, route, and where something is unseen or unreachable. */
import { useEffect, useMemo, useRef } from 'preact/hooks';
import { groundOf, wallsOf } from '../field/floor-map.tsx';
import { sliceOfFloor } from '../floors/cut.ts';
import type { Stage } from '../load/stage.ts';
import type { LayerProps } from '../measure/svg-parts.tsx';
import { countingOf } from '../network/graph.ts';
import { strengthColor } from '../network/strength.ts';
import { segmentsOf } from '../route/route.ts';
import { sealedGrounds } from '../shortfalls/shortfall-list.tsx';
import { linksShown } from '../stations/link-lines.ts';
import './flat-picture.css';
import { boxOf } from './piece-parts.ts';

/** What is as high as it is. */
const NO_FLOOR = '';

/** Local frame, metres, y turned round: coordinates of a site are too large for the precision of a drawing. */
export function FlatPicture({ store, loaded, view }: LayerProps) {
  const drawing = useRef<SVGSVGElement>(null);
  useEffect(
    () =>
      view.onFrame(() => {
        const { left, top, right, bottom } = view.box;
        const [from, to] = [view.levelAt(left, bottom, NO_FLOOR, 0), view.levelAt(right, top, NO_FLOOR, 0)];
        if (from === null || to === null) return;
        drawing.current?.setAttribute('viewBox', `${from[0]} ${-to[1]} ${to[0] - from[0]} ${to[1] - from[1]}`);
      }),
    [view],
  );
  const stage = useMemo((): Stage => ({ ...loaded.stage, offsetM: [0, 0, 0] }), [loaded]);
  const focus = store.unseenFocus.value;
  const unseen = focus && boxOf(focus.surface.pieces[focus.piece], loaded.stage.offsetM);
  const isShown = (floorId: string): boolean => sliceOfFloor(store.slices.value, floorId) !== undefined;
  return (
    <svg ref={drawing} class="flat-picture" preserveAspectRatio="none" aria-hidden="true" data-testid="flat-picture">
      {/* From the lowest up: upper floors lie over lower ones, as they do from above. */}
      {stage.floors
        .filter(({ id }) => isShown(id))
        .map(({ id }) => (
          <Floor key={id} stage={stage} floorId={id} />
        ))}
      {sealedGrounds(loaded, store.slices.value).flatMap(({ rectangles }) =>
        rectangles.map(([low, high]) => <Box key={`${low}`} {...{ low, high }} name="flat-sealed" />),
      )}
      {unseen !== null && <Box low={unseen[0]} high={unseen[1]} name="flat-unseen" />}
      <Links store={store} loaded={loaded} isShown={isShown} />
      <Route store={store} loaded={loaded} isShown={isShown} />
    </svg>
  );
}

function Floor({ stage, floorId }: { stage: Stage; floorId: string }) {
  const ground = useMemo(() => groundOf(stage, floorId).path, [stage, floorId]);
  const walls = useMemo(() => wallsOf(stage, floorId), [stage, floorId]);
  return (
    <>
      <path class="map-ground" d={ground} />
      <path class="map-walls" d={walls} />
    </>
  );
}

type OverFloors = Omit<LayerProps, 'view'> & { isShown(floorId: string): boolean };

function Links({ store, loaded, isShown }: OverFloors) {
  const { stations, links, chosen, isDark } = linksShown(store, countingOf(loaded.plan));
  const places = new Map(
    stations.filter(({ floorId }) => isShown(floorId)).map(({ id, positionM }) => [id, positionM]),
  );
  return links.map((link) => {
    const [from, to] = [places.get(link.a), places.get(link.b)];
    if (from === undefined || to === undefined) return null;
    const name = link === chosen ? 'flat-link flat-chosen' : 'flat-link';
    return <Line key={`${link.a} ${link.b}`} {...{ from, to, name }} color={strengthColor(link.strength, isDark)} />;
  });
}

function Route({ store, loaded, isShown }: OverFloors) {
  const route = store.showRoute.value ? store.shownRoute.value : null;
  if (route === null) return null;
  const chosen = route.legs.findIndex(({ to }) => to === store.stationId.value);
  return segmentsOf(route, loaded.stage.offsetM, loaded.stage.floors)
    .filter(({ fromFloor, toFloor }) => isShown(fromFloor) && isShown(toFloor))
    .map(({ leg, fromM: from, toM: to }) => (
      <Line key={`${leg} ${from}`} {...{ from, to }} name={leg === chosen ? 'map-way' : 'map-walk'} />
    ));
}

function Box({ low: [x, y], high: [toX, toY], name }: Record<'low' | 'high', readonly number[]> & { name: string }) {
  return <rect class={name} x={x} y={-toY} width={toX - x} height={toY - y} />;
}

interface LineProps {
  readonly from: readonly number[];
  readonly to: readonly number[];
  readonly name: string;
  readonly color?: string;
}

function Line({ from, to, name, color }: LineProps) {
  return (
    <line
      class={name}
      x1={from[0]}
      y1={-from[1]}
      x2={to[0]}
      y2={-to[1]}
      {...(color === undefined ? {} : { stroke: color })}
    />
  );
}
