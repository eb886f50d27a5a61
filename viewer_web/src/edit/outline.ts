/** Outlines drawn on a floor: polygons in plan, and what is wrong with them in words. */
import { t } from '../language/language.ts';
import type { Place } from './ground-map.ts';

/** A corner nearer to the one before is the same click twice. */
export const NEAREST_CORNERS_M = 0.05;
/** Smaller areas are slips. */
export const SMALLEST_AREA_M2 = 0.05;

/** Area by the shoelace formula; of a polygon that crosses itself it means nothing. */
export function areaM2(outline: readonly Place[]): number {
  let doubled = 0;
  outline.forEach(([x, y], i) => {
    const [nextX, nextY] = outline[(i + 1) % outline.length];
    doubled += x * nextY - nextX * y;
  });
  return Math.abs(doubled) / 2;
}

/** Why an outline is no area yet; null: it is one. */
export function faultOf(outline: readonly Place[]): string | null {
  if (outline.length < 3) {
    const missing = 3 - outline.length;
    return t('Click {n, plural, one {# more corner} other {# more corners}} on the floor.', { n: missing });
  }
  if (crosses(outline)) return t('The outline crosses itself. Remove the last corner and go round the area.');
  if (areaM2(outline) < SMALLEST_AREA_M2) return t('The outline has hardly any area. Draw it larger.');
  return null;
}

/** Whether a place lies inside an outline: a ray from it crosses the sides an odd number of times. */
export function isInside(outline: readonly Place[], [x, y]: Place): boolean {
  let isIn = false;
  outline.forEach(([ax, ay], i) => {
    const [bx, by] = outline[(i + 1) % outline.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) isIn = !isIn;
  });
  return isIn;
}

/** Whether two sides that are not neighbours meet. */
function crosses(outline: readonly Place[]): boolean {
  const n = outline.length;
  for (let i = 0; i < n; i++) {
    for (let j = i + 2; j < n; j++) {
      if (i === 0 && j === n - 1) continue;
      if (meet(outline[i], outline[i + 1], outline[j], outline[(j + 1) % n])) return true;
    }
  }
  return false;
}

function meet(a: Place, b: Place, c: Place, d: Place): boolean {
  const side = (p: Place, q: Place, r: Place): number =>
    Math.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]));
  const within = (p: Place, q: Place, r: Place): boolean =>
    r[0] >= Math.min(p[0], q[0]) &&
    r[0] <= Math.max(p[0], q[0]) &&
    r[1] >= Math.min(p[1], q[1]) &&
    r[1] <= Math.max(p[1], q[1]);
  const [s1, s2, s3, s4] = [side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)];
  if (s1 * s2 < 0 && s3 * s4 < 0) return true;
  return (
    (s1 === 0 && within(a, b, c)) ||
    (s2 === 0 && within(a, b, d)) ||
    (s3 === 0 && within(c, d, a)) ||
    (s4 === 0 && within(c, d, b))
  );
}
