/** Where a point that is drawn or dragged is meant to be: at corners, on lines, at right angles. */
import { type Corner, direction, distance, dot, leftOf, minus, nearestOn, plus } from './geometry.ts';

type Segment = readonly [Corner, Corner];

/** What a point was drawn to; `free`: nothing was near. */
export type SnapKind = 'corner' | 'line' | 'angle' | 'free';

export interface Snapped {
  readonly at: Corner;
  readonly kind: SnapKind;
}

const CELL_M = 1;
/** Directions from the last point, in steps of this, are drawn to within a few degrees. */
const STEP_RAD = Math.PI / 4;
const ANGLE_RAD = (4 * Math.PI) / 180;

/** Segments by the square metres that they cross: those near a point are found without looking at all of them. */
export class SegmentIndex {
  private readonly cells = new Map<string, Segment[]>();

  constructor(segments: Iterable<Segment>) {
    for (const segment of segments) {
      const [a, b] = segment;
      const steps = Math.max(1, Math.ceil((2 * distance(a, b)) / CELL_M));
      const seen = new Set<string>();
      for (let i = 0; i <= steps; i++) {
        const key = keyOf(plus(a, minus(b, a), i / steps));
        if (seen.has(key)) continue;
        seen.add(key);
        const cell = this.cells.get(key);
        if (cell === undefined) this.cells.set(key, [segment]);
        else cell.push(segment);
      }
    }
  }

  /** Those that may be within a distance, which is less than a cell. */
  near([x, y]: Corner): readonly Segment[] {
    const found = new Set<Segment>();
    for (let i = -1; i <= 1; i++) {
      for (let j = -1; j <= 1; j++) {
        for (const segment of this.cells.get(keyOf([x + i * CELL_M, y + j * CELL_M])) ?? []) found.add(segment);
      }
    }
    return [...found];
  }
}

const keyOf = ([x, y]: Corner): string => `${Math.floor(x / CELL_M)} ${Math.floor(y / CELL_M)}`;

export interface SnapTo {
  /** Axes of walls, before the lines of the drawing. */
  readonly axes: readonly Segment[];
  readonly lines: SegmentIndex | null;
  /** The other end of what is drawn; null: nothing has begun. */
  readonly from: Corner | null;
  /** Directions, besides those of the page, that right angles count from. */
  readonly along?: Corner | null;
  readonly withinM: number;
}

/** Ends of walls first, then corners of the drawing, then lines where a right angle meets them, then lines, then angles. */
export function snapped(at: Corner, { axes, lines, from, along = null, withinM }: SnapTo): Snapped {
  const within = Math.min(withinM, CELL_M);
  const others = lines?.near(at) ?? [];
  for (const segments of [axes, others]) {
    const corner = nearest(at, segments.flat(), within);
    if (corner !== null && (from === null || distance(corner, from) > 1e-6)) return { at: corner, kind: 'corner' };
  }
  const onAngle = from === null ? null : atRightAngle(at, from, along, within);
  for (const segments of [axes, others]) {
    const crossings = onAngle === null || from === null ? [] : segments.flatMap((one) => crossing(from, onAngle, one));
    const crossed = nearest(at, crossings, within);
    if (crossed !== null) return { at: crossed, kind: 'line' };
  }
  if (onAngle !== null) return { at: onAngle, kind: 'angle' };
  for (const segments of [axes, others]) {
    const on = nearest(
      at,
      segments.map(([a, b]) => nearestOn(a, b, at)),
      within,
    );
    if (on !== null) return { at: on, kind: 'line' };
  }
  return { at, kind: 'free' };
}

function nearest(at: Corner, points: readonly Corner[], within: number): Corner | null {
  let [best, bestM]: [Corner | null, number] = [null, within];
  for (const point of points) {
    const m = distance(at, point);
    if (m <= bestM) [best, bestM] = [point, m];
  }
  return best;
}

/** The foot on the nearest line through `from` at half right angles; null: none is near. */
function atRightAngle(at: Corner, from: Corner, along: Corner | null, within: number): Corner | null {
  const to = direction(from, at);
  if (to === null) return null;
  for (const base of [[1, 0] as const, ...(along === null ? [] : [along])]) {
    const angle = Math.atan2(dot(to, leftOf(base)), dot(to, base));
    const round = Math.round(angle / STEP_RAD) * STEP_RAD;
    const step: Corner = plus([base[0] * Math.cos(round), base[1] * Math.cos(round)], leftOf(base), Math.sin(round));
    const foot = plus(from, step, dot(minus(at, from), step));
    if (Math.abs(angle - round) <= ANGLE_RAD || distance(foot, at) <= within / 2) return foot;
  }
  return null;
}

/** Where the line from `from` through `through` crosses a segment. */
function crossing(from: Corner, through: Corner, [a, b]: Segment): readonly Corner[] {
  const [step, side] = [minus(through, from), minus(b, a)];
  const turn = step[0] * side[1] - step[1] * side[0];
  if (Math.abs(turn) < 1e-9) return [];
  const apart = minus(a, from);
  const t = (apart[0] * side[1] - apart[1] * side[0]) / turn;
  const u = (apart[0] * step[1] - apart[1] * step[0]) / turn;
  return u >= -1e-6 && u <= 1 + 1e-6 ? [plus(from, step, t)] : [];
}
