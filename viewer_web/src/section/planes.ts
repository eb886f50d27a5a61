/** What a section takes away: half-spaces in the local frame, of a box with its sides along the axes, or along a line in plan. */

export type PointM = readonly [number, number, number];
export type PlaceM = readonly [number, number];

/** Kept is where normal · point + offset >= 0; the normal has length 1. */
export interface CutPlane {
  readonly normal: PointM;
  readonly offsetM: number;
}

/** Lowest and highest corner. */
export interface SectionBox {
  readonly minM: PointM;
  readonly maxM: PointM;
}

/** Drawn on the plan; what lies to its left as one goes from one end to the other is kept, to its right if it is flipped. */
export interface SectionLine {
  readonly fromM: PlaceM;
  readonly toM: PlaceM;
  readonly isFlipped: boolean;
}

export type BoxSide = { readonly axis: 0 | 1 | 2; readonly end: 'min' | 'max' };
export const BOX_SIDES: readonly BoxSide[] = ([0, 1, 2] as const).flatMap((axis) => [
  { axis, end: 'min' as const },
  { axis, end: 'max' as const },
]);

/** Thinner than this a box shows nothing. */
export const THINNEST_M = 0.1;

export function planesOfBox({ minM, maxM }: SectionBox): CutPlane[] {
  return BOX_SIDES.map(({ axis, end }) => {
    const sign = end === 'min' ? 1 : -1;
    const normal: [number, number, number] = [0, 0, 0];
    normal[axis] = sign;
    return { normal, offsetM: -sign * (end === 'min' ? minM : maxM)[axis] };
  });
}

/** Which way one looks at the section: level, towards what is kept, of length 1. */
export function facingOf({ fromM, toM, isFlipped }: SectionLine): PlaceM {
  const [dx, dy] = [toM[0] - fromM[0], toM[1] - fromM[1]];
  const scale = (isFlipped ? -1 : 1) / Math.hypot(dx, dy);
  return [-dy * scale, dx * scale];
}

export function planeOfLine(line: SectionLine): CutPlane {
  const [x, y] = facingOf(line);
  return { normal: [x, y, 0], offsetM: -(x * line.fromM[0] + y * line.fromM[1]) };
}

export function isKept(planes: readonly CutPlane[], [x, y, z]: PointM, slackM = 1e-6): boolean {
  return planes.every(({ normal: [a, b, c], offsetM }) => a * x + b * y + c * z + offsetM >= -slackM);
}

/** The part of a ray, from `near` to `far` along it, that is kept; null: none of it. */
export function keptOfRay(
  planes: readonly CutPlane[],
  origin: PointM,
  direction: PointM,
  near: number,
  far: number,
): readonly [number, number] | null {
  let [from, to] = [near, far];
  for (const { normal, offsetM } of planes) {
    const along = dot(normal, direction);
    const at = dot(normal, origin) + offsetM;
    if (Math.abs(along) < 1e-12) {
      if (at < 0) return null;
    } else if (along > 0) from = Math.max(from, -at / along);
    else to = Math.min(to, -at / along);
  }
  return from < to ? [from, to] : null;
}

/** The box with a side at another place, no thinner than can be seen. */
export function withSide(box: SectionBox, { axis, end }: BoxSide, atM: number): SectionBox {
  const [min, max]: [number, number, number][] = [[...box.minM], [...box.maxM]];
  if (end === 'min') min[axis] = Math.min(atM, max[axis] - THINNEST_M);
  else max[axis] = Math.max(atM, min[axis] + THINNEST_M);
  return { minM: min, maxM: max };
}

const dot = (a: PointM, b: PointM): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
