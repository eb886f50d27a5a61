/** Straight walls and openings in plan coordinates, metres: from corners to axis and thickness, and back. */

export type Corner = readonly [number, number];
export type Corners = readonly Corner[];

/** A straight piece: its middle line from `a` to `b`, and how thick it is. */
export interface Straight {
  readonly a: Corner;
  readonly b: Corner;
  readonly thicknessM: number;
}

export const minus = (a: Corner, b: Corner): Corner => [a[0] - b[0], a[1] - b[1]];
/** `a + k b`. */
export const plus = (a: Corner, b: Corner, k = 1): Corner => [a[0] + k * b[0], a[1] + k * b[1]];
export const dot = (a: Corner, b: Corner): number => a[0] * b[0] + a[1] * b[1];
export const distance = (a: Corner, b: Corner): number => Math.hypot(a[0] - b[0], a[1] - b[1]);
const middle = (a: Corner, b: Corner): Corner => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];

/** The unit vector from one point to another; null: they are one. */
export function direction(from: Corner, to: Corner): Corner | null {
  const length = distance(from, to);
  return length < 1e-9 ? null : [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
}

export const leftOf = ([x, y]: Corner): Corner => [-y, x];

/** Corners of a rectangle differ from those of its parallelogram by less. */
const SQUARE_M = 0.02;

/** The axis of a rectangle along its longer sides; null: the outline is something else. */
export function straightOf(outline: Corners): Straight | null {
  if (outline.length !== 4) return null;
  const [p, q, r, s] = outline;
  if (distance(plus(p, r), plus(q, s)) > 2 * SQUARE_M) return null;
  const [first, second] = [distance(p, q), distance(q, r)];
  if (Math.min(first, second) < 1e-6 || Math.abs(dot(minus(q, p), minus(r, q))) > SQUARE_M * Math.max(first, second)) {
    return null;
  }
  return first >= second
    ? { a: middle(p, s), b: middle(q, r), thicknessM: second }
    : { a: middle(p, q), b: middle(s, r), thicknessM: first };
}

/** Corners of a straight piece: along its right side, then back along its left. Empty: it has no length. */
export function outlineOf({ a, b, thicknessM }: Straight): Corners {
  const along = direction(a, b);
  if (along === null) return [];
  const half = leftOf(along);
  const by = thicknessM / 2;
  return [plus(a, half, -by), plus(b, half, -by), plus(b, half, by), plus(a, half, by)];
}

/** The opening of a width in a wall, about a place along its axis: it stays within the wall. Null: the wall is shorter. */
export function openingIn(wall: Straight, alongM: number, widthM: number): Corners | null {
  const lengthM = distance(wall.a, wall.b);
  const along = direction(wall.a, wall.b);
  if (along === null || widthM > lengthM + 1e-9) return null;
  const at = Math.min(Math.max(alongM, widthM / 2), lengthM - widthM / 2);
  const part = { ...wall, a: plus(wall.a, along, at - widthM / 2), b: plus(wall.a, along, at + widthM / 2) };
  return outlineOf(part);
}

/** The axis of an opening, from jamb to jamb: unlike a wall's, it may be shorter than the wall is thick. */
export function straightOfOpening([c0, c1, c2, c3]: Corners): Straight {
  return { a: middle(c0, c3), b: middle(c1, c2), thicknessM: distance(c1, c2) };
}

/** How far along an axis a point lies, and how far beside it. */
export function alongAndBeside({ a, b }: Pick<Straight, 'a' | 'b'>, at: Corner): readonly [number, number] {
  const along = direction(a, b) ?? [1, 0];
  const from = minus(at, a);
  return [dot(from, along), dot(from, leftOf(along))];
}

/** The nearest point of a segment. */
export function nearestOn(a: Corner, b: Corner, at: Corner): Corner {
  const along = direction(a, b);
  if (along === null) return a;
  return plus(a, along, Math.min(Math.max(dot(minus(at, a), along), 0), distance(a, b)));
}

/** A spot inside of an outline, in the middle of where it is widest. */
export function spotInside(outline: Corners): Corner {
  const levels = [...new Set(outline.map(([, y]) => y))].sort((a, b) => a - b);
  let [best, spot] = [-1, outline[0]];
  for (let i = 1; i < levels.length; i++) {
    const y = (levels[i - 1] + levels[i]) / 2;
    const crossings = outline.flatMap(([x0, y0], k) => {
      const [x1, y1] = outline[(k + 1) % outline.length];
      return y0 > y !== y1 > y ? [x0 + ((x1 - x0) * (y - y0)) / (y1 - y0)] : [];
    });
    crossings.sort((a, b) => a - b);
    for (let k = 1; k < crossings.length; k += 2) {
      const size = Math.min(crossings[k] - crossings[k - 1], levels[i] - levels[i - 1]);
      if (size > best) [best, spot] = [size, [(crossings[k - 1] + crossings[k]) / 2, y]];
    }
  }
  return spot;
}

export function isInside(outline: Corners, [x, y]: Corner): boolean {
  let inside = false;
  for (let i = 0, j = outline.length - 1; i < outline.length; j = i++) {
    const [[xi, yi], [xj, yj]] = [outline[i], outline[j]];
    if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) inside = !inside;
  }
  return inside;
}

/** How far a point is from an outline; 0: inside. */
export function distanceTo(outline: Corners, at: Corner): number {
  if (isInside(outline, at)) return 0;
  return Math.min(
    ...outline.map((corner, i) => distance(at, nearestOn(corner, outline[(i + 1) % outline.length], at))),
  );
}

export const rounded = ([x, y]: Corner): Corner => [Math.round(x * 1e4) / 1e4 || 0, Math.round(y * 1e4) / 1e4 || 0];

export const moved = (outline: Corners, by: Corner): Corners => outline.map((corner) => rounded(plus(corner, by)));
