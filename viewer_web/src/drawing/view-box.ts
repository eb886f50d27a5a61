/** Which part of the plan the page shows: pixels in a metre, and where the plan's origin is on the page. y points up in the plan. */
import type { DrawnStorey } from '../api/documents.ts';
import type { Corner } from './geometry.ts';

export interface ViewBox {
  readonly perM: number;
  /** Pixels from the upper left corner of the picture. */
  readonly x: number;
  readonly y: number;
}

const [LEAST_PER_M, MOST_PER_M] = [0.05, 5000];

export const toPlan = ({ perM, x, y }: ViewBox, [px, py]: Corner): Corner => [(px - x) / perM, (y - py) / perM];
export const toPage = ({ perM, x, y }: ViewBox, [mx, my]: Corner): Corner => [x + perM * mx, y - perM * my];

/** A point of the page stays where it is. */
export function zoomed(view: ViewBox, by: number, [px, py]: Corner): ViewBox {
  const perM = Math.min(Math.max(view.perM * by, LEAST_PER_M), MOST_PER_M);
  const k = perM / view.perM;
  return { perM, x: px + k * (view.x - px), y: py + k * (view.y - py) };
}

/** All walls and openings of a storey, with a margin. */
export function around(storey: DrawnStorey, widthPx: number, heightPx: number): ViewBox {
  const corners = [...storey.walls.map(({ outline }) => outline), ...storey.openings.map((one) => one.corners)].flat();
  return aroundCorners(corners, widthPx, heightPx);
}

export function aroundCorners(corners: readonly Corner[], widthPx: number, heightPx: number): ViewBox {
  const [xs, ys] = [corners.map(([x]) => x), corners.map(([, y]) => y)];
  const least = (values: readonly number[]): number => values.reduce((a, b) => Math.min(a, b), Infinity);
  const most = (values: readonly number[]): number => values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (corners.length === 0) return { perM: 50, x: widthPx / 2, y: heightPx / 2 };
  const [low, high]: [Corner, Corner] = [
    [least(xs), least(ys)],
    [most(xs), most(ys)],
  ];
  const room = 0.88;
  const fit = Math.min((room * widthPx) / (high[0] - low[0] || 1), (room * heightPx) / (high[1] - low[1] || 1));
  const perM = Math.min(Math.max(fit, LEAST_PER_M), 300);
  return {
    perM,
    x: widthPx / 2 - (perM * (low[0] + high[0])) / 2,
    y: heightPx / 2 + (perM * (low[1] + high[1])) / 2,
  };
}
