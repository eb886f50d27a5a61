/** Where a cursor is that keys move, in pixels of the picture. */
export interface Cursor {
  readonly x: number;
  readonly y: number;
}

/** A press is fine enough to point at a door's edge, a key that is held crosses the picture in a few seconds. */
const STEP_PIXELS = 4;
const HELD_STEP_PIXELS = 16;
const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
};

/** The cursor after a key, within the picture; null: the key does not move it. */
export function movedCursor(
  at: Cursor,
  key: string,
  isHeld: boolean,
  widthPixels: number,
  heightPixels: number,
): Cursor | null {
  const by = ARROWS[key];
  if (by === undefined) return null;
  const step = isHeld ? HELD_STEP_PIXELS : STEP_PIXELS;
  const within = (value: number, size: number): number => Math.min(Math.max(value, 1), size - 1);
  return { x: within(at.x + step * by[0], widthPixels), y: within(at.y + step * by[1], heightPixels) };
}
