import { expect, test } from 'vitest';
import { siteOf } from '../measure/site.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { CUBE_FACES, faceTransform, groundTransform, sideName } from './view-cube.ts';

const HALF = 10;

/** Faces that a camera sees, each with where its middle and what is up on it are drawn: right and down, from the cube's middle. */
function seen(pose: readonly number[]): Record<string, { middle: number[]; up: number[] }> {
  const drawn = CUBE_FACES.map((face) => [face.id, faceTransform(face, pose, HALF)] as const);
  return Object.fromEntries(
    drawn.flatMap(([id, transform]) => {
      if (transform === null) return [];
      const [, , c, d, e, f] = transform.match(/-?[\d.]+/g)!.map(Number);
      return [[id, { middle: [e, f], up: [-c, -d] }]];
    }),
  );
}

test('from the south-west and above, the top and those two sides are seen, each where it is', () => {
  const faces = seen([-5, -8, 9, 0, 0, 0]);
  expect(Object.keys(faces).sort()).toEqual(['-x', '-y', 'top']);
  expect(faces.top.middle[1]).toBeLessThan(0);
  expect(faces['-x'].middle[0]).toBeLessThan(0);
  expect(faces['-y'].middle[0]).toBeGreaterThan(0);
  // Words on the sides stand upright.
  expect(faces['-y'].up).toEqual([expect.closeTo(0), expect.closeTo(-0.72, 1)]);
});

test('from straight above only the top is seen, as the plan has it, and nothing is upside down in it', () => {
  const faces = seen([3, 2 - 0.0005, 11, 3, 2, 1]);
  expect(faces).toEqual({ top: { middle: [expect.closeTo(0), expect.closeTo(0, 1)], up: [expect.closeTo(0), -1] } });
  // From the east, +y is to the right.
  expect(seen([3.0005, 2, 11, 3, 2, 1]).top.up).toEqual([1, expect.closeTo(0, 2)]);
});

test('from below, the foot is seen in place of the top', () => {
  expect(Object.keys(seen([0, -8, -5, 0, 0, 0])).sort()).toEqual(['-y', 'bottom']);
  expect(groundTransform([0, 0, 9, 0, 0.001, 0], HALF)).toMatch(/^matrix\(1\.0000 /);
});

test('sides have the nearest of eight winds where there is a north, else their axis', () => {
  const { scene } = smallPlan();
  expect(sideName('-y', scene)).toEqual({ short: '−y', name: '−y' });
  const georeference = { to_map: null, true_north: [0, 1] } as unknown as NonNullable<typeof scene.georeference>;
  const facing = (true_north: [number, number]) =>
    (['+y', '+x', '-y', '-x'] as const).map(
      (side) => sideName(side, { ...scene, georeference: { ...georeference, true_north } }).short,
    );
  expect(facing([0, 1])).toEqual(['N', 'E', 'S', 'W']);
  // North is where +x points.
  expect(facing([1, 0])).toEqual(['W', 'N', 'E', 'S']);
  expect(facing([Math.sin(0.3), Math.cos(0.3)])).toEqual(['N', 'E', 'S', 'W']);
  expect(facing([Math.sin(0.5), Math.cos(0.5)])).toEqual(['NW', 'NE', 'SE', 'SW']);
  expect(siteOf(scene)).toBeNull();
});
