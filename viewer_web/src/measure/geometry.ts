/** What is measured between points: lengths, heights, angles, areas. Scene frame, metres and radians. */

export type PointM = readonly [number, number, number];

export interface Distance {
  readonly straightM: number;
  /** In plan. */
  readonly levelM: number;
  /** Of the second point above the first. */
  readonly riseM: number;
}

export function distanceOf(from: PointM, to: PointM): Distance {
  const [dx, dy, dz] = minus(to, from);
  return { straightM: Math.hypot(dx, dy, dz), levelM: Math.hypot(dx, dy), riseM: dz };
}

export interface Angle {
  /** Between both legs, 0 ... pi. */
  readonly angleRad: number;
  /** The same in plan; null: a leg is upright. */
  readonly inPlanRad: number | null;
}

/** At the middle of three points. */
export function angleOf(a: PointM, at: PointM, b: PointM): Angle {
  const [u, v] = [minus(a, at), minus(b, at)];
  const [flatU, flatV]: PointM[] = [
    [u[0], u[1], 0],
    [v[0], v[1], 0],
  ];
  const isUpright = Math.hypot(...flatU) < 1e-6 || Math.hypot(...flatV) < 1e-6;
  return { angleRad: between(u, v), inPlanRad: isUpright ? null : between(flatU, flatV) };
}

export interface Area {
  readonly areaM2: number;
  readonly perimeterM: number;
  /** How far the farthest corner is off the plane of the area. */
  readonly offPlaneM: number;
  /** Two sides cross: that is no area. */
  readonly isCrossed: boolean;
}

/** Of the polygon with these corners, at least three, in the plane that fits them (Newell's normal). */
export function areaOf(corners: readonly PointM[]): Area {
  const middle = corners.reduce<PointM>(plus, [0, 0, 0]).map((x) => x / corners.length) as unknown as PointM;
  // Around the middle: coordinates of millions would eat the digits.
  const around = corners.map((corner) => minus(corner, middle));
  const next = (i: number): PointM => around[(i + 1) % around.length];
  const twice = around.reduce<PointM>((sum, corner, i) => plus(sum, cross(corner, next(i))), [0, 0, 0]);
  const areaM2 = Math.hypot(...twice) / 2;
  const normal: PointM = areaM2 > 1e-9 ? (twice.map((x) => x / (2 * areaM2)) as unknown as PointM) : [0, 0, 1];
  return {
    areaM2,
    perimeterM: around.reduce((sum, corner, i) => sum + Math.hypot(...minus(next(i), corner)), 0),
    offPlaneM: Math.max(...around.map((corner) => Math.abs(dot(corner, normal)))),
    isCrossed: hasCrossing(around, normal),
  };
}

function hasCrossing(corners: readonly PointM[], normal: PointM): boolean {
  const n = corners.length;
  // Seen along the largest part of the normal.
  const [drop] = [0, 1, 2].sort((i, j) => Math.abs(normal[j]) - Math.abs(normal[i]));
  const flat = corners.map((corner) => corner.filter((_, k) => k !== drop));
  const turn = (i: number, j: number, k: number): number =>
    (flat[j][0] - flat[i][0]) * (flat[k][1] - flat[i][1]) - (flat[j][1] - flat[i][1]) * (flat[k][0] - flat[i][0]);
  for (let i = 0; i < n; i++) {
    for (let j = i + 2; j < n; j++) {
      if (i === 0 && j === n - 1) continue;
      const [a, b, c, d] = [i, i + 1, j, (j + 1) % n];
      if (turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0) return true;
    }
  }
  return false;
}

/** Not by the cosine alone, which tells small angles apart badly. */
const between = (u: PointM, v: PointM): number => Math.atan2(Math.hypot(...cross(u, v)), dot(u, v));
const plus = (a: PointM, b: PointM): PointM => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a: PointM, b: PointM): PointM => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: PointM, b: PointM): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: PointM, b: PointM): PointM => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
