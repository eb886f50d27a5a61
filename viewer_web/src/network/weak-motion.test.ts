import { expect, test } from 'vitest';
import { northHint, weakMotionOf } from './weak-motion.ts';

test.each([
  ['slides along x', 'shift E–W'],
  ['slides along y', 'shift N–S'],
  ['slides along 30 degrees from x to y', 'shift NE–SW'],
  ['slides along 20 degrees from x to y', 'shift E–W'],
  ['slides along 150 degrees from x to y', 'shift NW–SE'],
  ['slides along the vertical', 'shift up–down'],
  ['slides along (0.77, 0.00, -0.64)', 'shift on a slope'],
  ['turns about the vertical', 'turn (heading)'],
  ['tilts about x', 'tilt about E–W'],
  ['tilts about y', 'tilt about N–S'],
  ['tilts about 134 degrees from x to y', 'tilt about NW–SE'],
  ['tilts about 179 degrees from x to y', 'tilt about E–W'],
  ['tilts about (0.00, 0.77, 0.64)', 'turn about a slope'],
])('"%s" is "%s" to a surveyor', (words, short) => {
  expect(weakMotionOf(words)?.short).toBe(short);
});

test.each([
  ['tilts about 134 degrees from x to y', 'tilt about a horizontal line NW–SE (bearing 136°)', 'NE or SW'],
  ['tilts about y', 'tilt about a horizontal line N–S (bearing 0°)', 'E or W'],
  ['slides along x', 'shift along E–W (bearing 90°)', 'faces E or W'],
  ['slides along 100 degrees from x to y', 'shift along N–S (bearing 170°)', 'faces N or S'],
])('"%s" is told with its bearing, and what would hold it', (words, long, why) => {
  const found = weakMotionOf(words);
  expect(found?.long).toBe(long);
  expect(found?.why).toContain(why);
});

test('a line that rises is told by the side that it rises to, whichever way its axis points', () => {
  expect(weakMotionOf('slides along (0.77, 0.00, -0.64)')?.long).toBe('shift along a line rising 40° towards W');
  expect(weakMotionOf('slides along (-0.77, 0.00, 0.64)')?.long).toBe('shift along a line rising 40° towards W');
  expect(weakMotionOf('tilts about (0.50, 0.50, 0.71)')?.long).toBe('rotation about a line rising 45° towards NE');
});

/** Every whole degree as the planner writes it, against the angle between the line that is named and the axis itself. */
test('the line that is named is the nearest of four', () => {
  const bearing: Record<string, number> = { 'N–S': 0, 'NE–SW': 45, 'E–W': 90, 'NW–SE': 135 };
  for (let angle = 0; angle < 180; angle++) {
    const short = weakMotionOf(`tilts about ${angle} degrees from x to y`)!.short;
    const off = Math.abs(bearing[short.replace('tilt about ', '')] - ((90 - angle + 180) % 180));
    expect(Math.min(off, 180 - off)).toBeLessThanOrEqual(22.5);
  }
});

test('what is not known has no words, and other words stay as they are', () => {
  expect(weakMotionOf('')).toBeNull();
  expect(weakMotionOf('wobbles')?.short).toBe('wobbles');
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
