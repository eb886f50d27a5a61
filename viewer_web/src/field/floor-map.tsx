/** A map of one floor: its ground and walls, the way to the next station, and the stations with their numbers. */
import { useMemo } from 'preact/hooks';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { sectionLines } from './section-lines.ts';
import type { Stop } from './walk.ts';

/** More triangles are too many for a drawing; the map then has no ground. */
const MOST_TRIANGLES = 40_000;
const MARGIN_M = 0.8;

interface FloorMapProps {
  readonly loaded: LoadedPlan;
  readonly floorId: string;
  readonly stops: readonly Stop[];
  readonly next: Stop | null;
  readonly done: ReadonlySet<string>;
  readonly onPick: (stop: Stop) => void;
}

export function FloorMap({ loaded, floorId, stops, next, done, onPick }: FloorMapProps) {
  const ground = useMemo(() => groundOf(loaded, floorId), [loaded, floorId]);
  const walls = useMemo(() => wallsOf(loaded, floorId), [loaded, floorId]);
  const here = stops.filter((stop) => stop.floorId === floorId);
  const box = boxOf([...ground.points, ...here.map(({ positionM }) => positionM)]);
  const dot = Math.max(box.width, box.height) / 34;
  const way = next !== null && next.floorId === floorId ? next.way : [];
  return (
    // y grows upwards in the building, downwards on the page.
    // biome-ignore lint/a11y/useSemanticElements: an SVG has no fieldset.
    <svg
      class="floor-map"
      viewBox={`${box.x} ${-box.y - box.height} ${box.width} ${box.height}`}
      role="group"
      aria-label="Map of the floor"
    >
      <path class="map-ground" d={ground.path} />
      <path class="map-walls" d={walls} stroke-width={dot / 9} />
      {here.slice(1).map((stop) => (
        <polyline key={stop.stationId} class="map-walk" points={flat(stop.way)} stroke-width={dot / 5} />
      ))}
      <polyline class="map-way" points={flat(way)} stroke-width={dot / 2.4} />
      {here.map((stop) => (
        // biome-ignore lint/a11y/useSemanticElements: an SVG has no buttons.
        <g
          key={stop.stationId}
          role="button"
          tabIndex={0}
          aria-label={`Station ${stop.stationId}${done.has(stop.stationId) ? ', done' : ''}`}
          class={lookOf(stop, next, done)}
          onClick={() => onPick(stop)}
          onKeyDown={(event) => {
            if (event.key === 'Enter' || event.key === ' ') onPick(stop);
          }}
        >
          <circle cx={stop.positionM[0]} cy={-stop.positionM[1]} r={stop === next ? 1.35 * dot : dot} />
          <text
            x={stop.positionM[0]}
            y={-stop.positionM[1]}
            font-size={1.05 * dot}
            text-anchor="middle"
            dominant-baseline="central"
          >
            {done.has(stop.stationId) ? '✓' : stop.order}
          </text>
        </g>
      ))}
    </svg>
  );
}

function lookOf(stop: Stop, next: Stop | null, done: ReadonlySet<string>): string {
  if (done.has(stop.stationId)) return 'map-stop map-done';
  return stop === next ? 'map-stop map-next' : 'map-stop';
}

const flat = (points: readonly (readonly [number, number, number])[]): string =>
  points.map(([x, y]) => `${x.toFixed(2)},${(-y).toFixed(2)}`).join(' ');

function wallsOf({ stage }: LoadedPlan, floorId: string): string {
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
function groundOf({ stage }: LoadedPlan, floorId: string): { path: string; points: Flat[] } {
  const { triangles, floors, offsetM } = stage;
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
