import { expect, test } from 'vitest';
import type { WeakMotion } from '../load/plan-json.ts';
import { northHint, weakMotionOf } from './weak-motion.ts';

type Direction = WeakMotion['direction'];

const X: Direction = [1, 0, 0];
const Y: Direction = [0, 1, 0];
const VERTICAL: Direction = [0, 0, 1];

/** A level line, its angle from +x towards +y. */
const level = (deg: number): Direction => [Math.cos((deg * Math.PI) / 180), Math.sin((deg * Math.PI) / 180), 0];
const shift = (direction: Direction): WeakMotion => ({ kind: 'shift', direction });
const turn = (direction: Direction): WeakMotion => ({ kind: 'turn', direction });

test.each([
  [shift(X), 'shift E–W'],
  [shift(Y), 'shift N–S'],
  [shift(level(30)), 'shift NE–SW'],
  [shift(level(20)), 'shift E–W'],
  [shift(level(150)), 'shift NW–SE'],
  [shift(VERTICAL), 'shift up–down'],
  [shift([0.77, 0, -0.64]), 'shift on a slope'],
  [turn(VERTICAL), 'turn (heading)'],
  [turn(X), 'tilt about E–W'],
  [turn(Y), 'tilt about N–S'],
  [turn(level(134)), 'tilt about NW–SE'],
  [turn(level(179)), 'tilt about E–W'],
  [turn([0, 0.77, 0.64]), 'turn about a slope'],
])('%o is "%s" to a surveyor', (motion, short) => {
  expect(weakMotionOf(motion)?.short).toBe(short);
});

test.each([
  [turn(level(134)), 'tilt about a horizontal line NW–SE (bearing 136°)', 'NE or SW'],
  [turn(Y), 'tilt about a horizontal line N–S (bearing 0°)', 'E or W'],
  [shift(X), 'shift along E–W (bearing 90°)', 'faces E or W'],
  [shift(level(100)), 'shift along N–S (bearing 170°)', 'faces N or S'],
])('%o is told with its bearing, and what would hold it', (motion, long, why) => {
  const found = weakMotionOf(motion);
  expect(found?.long).toBe(long);
  expect(found?.why).toContain(why);
});

test('a line that rises is told by the side that it rises to, whichever way its axis points', () => {
  expect(weakMotionOf(shift([0.77, 0, -0.64]))?.long).toBe('shift along a line rising 40° towards W');
  expect(weakMotionOf(shift([-0.77, 0, 0.64]))?.long).toBe('shift along a line rising 40° towards W');
  expect(weakMotionOf(turn([0.5, 0.5, 0.71]))?.long).toBe('rotation about a line rising 45° towards NE');
});

/** Every whole degree as the planner writes it, against the angle between the line that is named and the axis itself. */
test('the line that is named is the nearest of four', () => {
  const bearing: Record<string, number> = { 'N–S': 0, 'NE–SW': 45, 'E–W': 90, 'NW–SE': 135 };
  for (let angle = 0; angle < 180; angle++) {
    const short = weakMotionOf(turn(level(angle)))!.short;
    const off = Math.abs(bearing[short.replace('tilt about ', '')] - ((90 - angle + 180) % 180));
    expect(Math.min(off, 180 - off)).toBeLessThanOrEqual(22.5);
  }
});

test('what is not known has no words', () => {
  expect(weakMotionOf(null)).toBeNull();
});

test('where the map is turned, its north is told beside that of the words', () => {
  const turned = (deg: number): number[][] => {
    const [cos, sin] = [Math.cos((deg * Math.PI) / 180), Math.sin((deg * Math.PI) / 180)];
    return [
      [cos, -sin, 0, 458870],
      [sin, cos, 0, 5438260],
    ];
  };
  expect(northHint(null)).toBe('North is up on the maps: y of the model.');
  expect(northHint(turned(0.1))).toBe('North is up on the maps: y of the model.');
  // The map's axes turned by 24.5 degrees: its y is what lies that far from the model's y towards x.
  expect(northHint(turned(24.5))).toMatch(/Grid north is 25° clockwise from it/);
  expect(northHint(turned(-30))).toMatch(/Grid north is 30° anticlockwise from it/);
});
