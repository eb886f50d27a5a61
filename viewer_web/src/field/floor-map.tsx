/** A map of one floor: its ground and walls, the way to the next station, and the stations with their numbers. */

import { useEffect, useMemo, useState } from 'preact/hooks';
import { t } from '../language/language.ts';
import type { FieldPlan } from '../load/fetch-plan.ts';
import type { Stage } from '../load/stage.ts';
import { heightWords } from '../panels/figures.ts';
import { nameOf } from '../rooms/rooms.ts';
import type { Stop } from './route.ts';
import { sectionLines } from './section-lines.ts';
import { type Stack, shownOf, stacksOf } from './stacks.ts';
import { targetsOf } from './targets.ts';

/** More triangles are too many for a drawing; the map then has no ground. */
const MOST_TRIANGLES = 40_000;
const MARGIN_M = 0.8;
/** Nearer than this, in radii of a dot, one covers the number of another. */
const COVERS = 1.3;
/** Of rooms' names, in radii of a dot; and where they may stand, downwards from the middle. */
const NAME_SIZE = 1;
const SHIFTS = [0, 1.8, -1.8, 3.2, -3.2] as const;

interface FloorMapProps {
  readonly loaded: FieldPlan;
  readonly floorId: string;
  readonly stops: readonly Stop[];
  readonly next: Stop | null;
  readonly done: ReadonlySet<string>;
  readonly onPick: (stop: Stop) => void;
}

export function FloorMap({ loaded, floorId, stops, next, done, onPick }: FloorMapProps) {
  const ground = useMemo(() => groundOf(loaded.stage, floorId), [loaded, floorId]);
  const walls = useMemo(() => wallsOf(loaded.stage, floorId), [loaded, floorId]);
  const here = stops.filter((stop) => stop.floorId === floorId);
  const targets = targetsOf(loaded.plan, here);
  const box = boxOf([...ground.points, ...[...here, ...targets].map(({ positionM: [x, y] }): Flat => [x, y])]);
  const dot = Math.max(box.width, box.height) / 34;
  const way = next !== null && next.floorId === floorId ? next.way : [];
  const [opened, open] = useState<Stack | null>(null);
  useEffect(() => open(null), [floorId]);
  const press = (stack: Stack): void => {
    if (stack.length > 1) open(stack);
    else onPick(stack[0]);
  };
  return (
    <div class="map-frame">
      {/* y grows upwards in the building, downwards on the page. */}
      {/* biome-ignore lint/a11y/useSemanticElements: an SVG has no fieldset. */}
      <svg
        class="floor-map"
        viewBox={`${box.x} ${-box.y - box.height} ${box.width} ${box.height}`}
        role="group"
        aria-label={t('Map of the floor')}
      >
        <path class="map-ground" d={ground.path} />
        <path class="map-walls" d={walls} stroke-width={dot / 9} />
        {here.slice(1).map((stop) => (
          <polyline key={stop.stationId} class="map-walk" points={flat(stop.way)} stroke-width={dot / 5} />
        ))}
        {loaded.layers?.rooms?.list.map((room, number) => {
          if (room.floor !== floorId) return null;
          const name = nameOf(room, number);
          const [x, y] = [room.label[0] + loaded.stage.offsetM[0], -room.label[1] - loaded.stage.offsetM[1]];
          return (
            <text
              key={room.label.join()}
              class="map-room"
              x={x}
              y={y + shiftBesideStops([x, y], name, here, dot)}
              font-size={NAME_SIZE * dot}
              stroke-width={0.25 * dot}
              text-anchor="middle"
              dominant-baseline="central"
            >
              {name}
            </text>
          );
        })}
        {targets.map(({ positionM: [x, y], stationIds }) => (
          <rect
            key={`${stationIds.join()} ${x} ${y}`}
            class={next !== null && stationIds.includes(next.stationId) ? 'map-target map-target-next' : 'map-target'}
            x={x - 0.4 * dot}
            y={-y - 0.4 * dot}
            width={0.8 * dot}
            height={0.8 * dot}
          >
            <title>{t('Target for {pair}', { pair: stationIds.join(' – ') })}</title>
          </rect>
        ))}
        <polyline class="map-way" points={flat(way)} stroke-width={dot / 2.4} />
        {stacksOf(here, COVERS * dot).map((stack) => (
          <Dot
            key={stack[0].stationId}
            stack={stack}
            next={next}
            done={done}
            radius={dot}
            onPress={() => press(stack)}
          />
        ))}
      </svg>
      {opened !== null && (
        <StackList
          stack={opened}
          done={done}
          onPick={(stop) => {
            open(null);
            onPick(stop);
          }}
          onClose={() => open(null)}
        />
      )}
    </div>
  );
}

/** How far down a room's name goes so that no station covers it, if any place near its middle is free. */
function shiftBesideStops(
  [x, y]: readonly [number, number],
  name: string,
  stops: readonly Stop[],
  dot: number,
): number {
  const halfWidth = 0.3 * NAME_SIZE * dot * name.length + dot;
  const isFree = (down: number): boolean =>
    stops.every(
      ({ positionM }) => Math.abs(positionM[0] - x) > halfWidth || Math.abs(-positionM[1] - y - down) > 1.6 * dot,
    );
  return SHIFTS.map((shift) => shift * dot).find(isFree) ?? 0;
}

interface DotProps {
  readonly stack: Stack;
  readonly next: Stop | null;
  readonly done: ReadonlySet<string>;
  readonly radius: number;
  readonly onPress: () => void;
}

/** A station with its number, or several at one spot with one's number and how many they are. */
function Dot({ stack, next, done, radius, onPress }: DotProps) {
  const shown = shownOf(stack, next, done);
  const [x, y] = shownPlace(stack);
  const isNext = shown.stationId === next?.stationId;
  const areDone = stack.every(({ stationId }) => done.has(stationId));
  const size = isNext ? 1.35 * radius : radius;
  return (
    // biome-ignore lint/a11y/useSemanticElements: an SVG has no buttons.
    <g
      role="button"
      tabIndex={0}
      aria-label={stackName(stack, done)}
      class={`map-stop ${areDone ? 'map-done' : isNext ? 'map-next' : ''}`.trim()}
      onClick={onPress}
      onKeyDown={(event) => {
        if (event.key === 'Enter' || event.key === ' ') onPress();
      }}
    >
      {stack.length > 1 && <circle class="map-stack" cx={x} cy={y} r={1.28 * size} />}
      <circle cx={x} cy={y} r={size} />
      <text x={x} y={y} font-size={1.05 * radius} text-anchor="middle" dominant-baseline="central">
        {areDone ? '✓' : shown.number}
      </text>
      {stack.length > 1 && (
        <g class="map-count">
          <circle cx={x + size} cy={y - size} r={0.62 * radius} />
          <text x={x + size} y={y - size} font-size={0.8 * radius} text-anchor="middle" dominant-baseline="central">
            {stack.length}
          </text>
        </g>
      )}
    </g>
  );
}

const shownPlace = ([{ positionM }]: Stack): [number, number] => [positionM[0], -positionM[1]];

function stackName(stack: Stack, done: ReadonlySet<string>): string {
  const names = stack.map(({ stationId }) => (done.has(stationId) ? t('{id}, done', { id: stationId }) : stationId));
  return stack.length === 1
    ? t('{number}, station {id}', { number: stack[0].number, id: names[0] })
    : t('{n} stations here: {names}', { n: stack.length, names: names.join('; ') });
}

interface StackListProps {
  readonly stack: Stack;
  readonly done: ReadonlySet<string>;
  readonly onPick: (stop: Stop) => void;
  readonly onClose: () => void;
}

/** The stations of one spot, to choose from. */
function StackList({ stack, done, onPick, onClose }: StackListProps) {
  return (
    <section class="map-list" aria-label={t('Stations at this position')}>
      <header>
        <h2>{t('{n} stations here', { n: stack.length })}</h2>
        <button type="button" class="field-quiet" onClick={onClose}>
          {t('Close')}
        </button>
      </header>
      <ul>
        {stack.map((stop) => (
          <li key={stop.stationId}>
            <button type="button" onClick={() => onPick(stop)}>
              <span class="dot">{stop.number}</span>
              <span>{stop.stationId}</span>
              <span class="muted">
                {t('sensor at {height}', { height: heightWords(stop.heightM) })}
                {done.has(stop.stationId) ? ` · ${t('done')} ✓` : ''}
              </span>
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

const flat = (points: readonly (readonly [number, number, number])[]): string =>
  points.map(([x, y]) => `${x.toFixed(2)},${(-y).toFixed(2)}`).join(' ');

/** Walls of a floor as one path, scene frame with y turned round. */
export function wallsOf(stage: Stage, floorId: string): string {
  const lines = sectionLines(stage, floorId);
  const parts: string[] = [];
  for (let i = 0; i < lines.length; i += 4) {
    const [x1, y1, x2, y2] = lines.slice(i, i + 4);
    parts.push(`M${x1.toFixed(3)},${(-y1).toFixed(3)}L${x2.toFixed(3)},${(-y2).toFixed(3)}`);
  }
  return parts.join('');
}

type Flat = readonly [number, number, ...number[]];

/** Triangles of the floor's ground as one path, scene frame with y turned round. */
export function groundOf({ triangles, floors, offsetM }: Stage, floorId: string): { path: string; points: Flat[] } {
  const index = floors.find(({ id }) => id === floorId)?.index;
  const own: number[] = [];
  for (let t = 0; t < triangles.count; t++) {
    if (index !== undefined && triangles.groundOf[t] === index + 1) own.push(t);
  }
  if (own.length > MOST_TRIANGLES) return { path: '', points: [] };
  const points: Flat[] = [];
  const path = own.map((t) => {
    const corners = [0, 3, 6].map((k): Flat => {
      const at = 9 * t + k;
      return [triangles.cornersM[at] + offsetM[0], triangles.cornersM[at + 1] + offsetM[1]];
    });
    points.push(...corners);
    return `M${corners.map(([x, y]) => `${x.toFixed(3)},${(-y).toFixed(3)}`).join('L')}Z`;
  });
  return { path: path.join(''), points };
}

function boxOf(points: readonly Flat[]): { x: number; y: number; width: number; height: number } {
  const xs = points.map(([x]) => x);
  const ys = points.map(([, y]) => y);
  const [x, y] = [
    xs.reduce((a, b) => Math.min(a, b), 1e9) - MARGIN_M,
    ys.reduce((a, b) => Math.min(a, b), 1e9) - MARGIN_M,
  ];
  return {
    x,
    y,
    width: xs.reduce((a, b) => Math.max(a, b), -1e9) + MARGIN_M - x,
    height: ys.reduce((a, b) => Math.max(a, b), -1e9) + MARGIN_M - y,
  };
}
