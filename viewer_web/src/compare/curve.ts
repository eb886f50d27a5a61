/** Coverage against stations as lines of a small diagram: what each further station adds. */

export interface Curve {
  readonly title: string;
  /** Fraction of the achievable area after 1, 2, ... stations; null: not known. */
  readonly fractions: readonly (number | null)[];
  /** Class of its line. */
  readonly look: 'shown' | 'other' | 'draft';
}

export interface Frame {
  readonly width: number;
  readonly height: number;
  /** Room for the axes. */
  readonly left: number;
  readonly bottom: number;
  readonly top: number;
  readonly right: number;
}

export interface Scale {
  readonly x: (nStations: number) => number;
  readonly y: (fraction: number) => number;
  readonly mostStations: number;
}

/** One scale for all curves, from no station to the longest, from nothing to all. */
export function scaleOf(curves: readonly Curve[], frame: Frame): Scale {
  const mostStations = Math.max(1, ...curves.map(({ fractions }) => fractions.length));
  const innerWidth = frame.width - frame.left - frame.right;
  const innerHeight = frame.height - frame.top - frame.bottom;
  return {
    x: (n) => frame.left + (innerWidth * n) / mostStations,
    y: (fraction) => frame.top + innerHeight * (1 - fraction),
    mostStations,
  };
}

/** The points of an SVG polyline, beginning at no station and nothing seen. */
export function pointsOf({ fractions }: Curve, { x, y }: Scale): string {
  const points: [number, number][] = [[0, 0]];
  fractions.forEach((fraction, i) => {
    if (fraction !== null) points.push([i + 1, fraction]);
  });
  return points.map(([n, fraction]) => `${x(n).toFixed(1)},${y(fraction).toFixed(1)}`).join(' ');
}

/** Round numbers of stations to write under the axis, five at most besides 0. */
export function stationTicks(mostStations: number): number[] {
  const rough = mostStations / 5;
  const power = 10 ** Math.floor(Math.log10(Math.max(rough, 1)));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough) ?? 10 * power;
  return Array.from({ length: Math.floor(mostStations / step) + 1 }, (_, i) => i * step);
}
