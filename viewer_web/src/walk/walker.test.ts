import { expect, test } from 'vitest';
import {
  standing,
  standingOnMap,
  step,
  targetOf,
  turned,
  type WalkInput,
  type WalkPose,
  type WalkWorld,
} from './walker.ts';

const POSE: WalkPose = { eyeM: [0, 0, 1.65], headingRad: 0, pitchRad: 0, eyeHeightM: 1.65 };
const FORWARD: WalkInput = { forward: 1, right: 0, turn: 0, isFast: false };

/** Ground of a height by place; a wall across x at `wallX`, reaching from the ground up to `wallTop`. */
function world(ground: (x: number, y: number) => number | null, wallX = 1e9, wallTop = 3): WalkWorld {
  return {
    groundBelow: (x, y, z, depthM) => {
      const height = ground(x, y);
      return height !== null && height <= z && height >= z - depthM ? height : null;
    },
    floorBelow: (x, y, z, depthM) => {
      const heightM = ground(x, y);
      return heightM !== null && heightM <= z && heightM >= z - depthM ? { heightM, floorId: 'F0' } : null;
    },
    freeAhead: ([x, , z], [dx]) => (dx > 0 && z < wallTop && wallX > x ? (wallX - x) / dx : Number.POSITIVE_INFINITY),
  };
}
const level = world(() => 0);

function walked(pose: WalkPose, input: WalkInput, seconds: number, where: WalkWorld): WalkPose {
  let at = pose;
  for (let i = 0; i < 50; i++) at = step(at, input, seconds / 50, where);
  return at;
}

test('one walks along the heading, sideways to its right, and no faster askew', () => {
  const ahead = walked({ ...POSE, headingRad: Math.PI / 2 }, FORWARD, 1, level);
  expect(ahead.eyeM[0]).toBeCloseTo(0);
  expect(ahead.eyeM[1]).toBeGreaterThan(1);
  const right = walked(POSE, { ...FORWARD, forward: 0, right: 1 }, 1, level);
  expect(right.eyeM[1]).toBeLessThan(-1);
  const askew = walked(POSE, { ...FORWARD, right: 1 }, 1, level);
  expect(Math.hypot(askew.eyeM[0], askew.eyeM[1])).toBeCloseTo(ahead.eyeM[1]);
  const fast = walked(POSE, { ...FORWARD, isFast: true }, 1, level);
  expect(fast.eyeM[0]).toBeGreaterThan(2 * ahead.eyeM[1]);
});

test('one stops before a wall and slides along it', () => {
  const wall = world(() => 0, 2);
  const stopped = walked(POSE, FORWARD, 5, wall);
  expect(stopped.eyeM[0]).toBeGreaterThan(1.5);
  expect(stopped.eyeM[0]).toBeLessThan(1.8);
  const slid = walked({ ...POSE, headingRad: 0.7 }, FORWARD, 5, wall);
  expect(slid.eyeM[0]).toBeLessThan(1.8);
  expect(slid.eyeM[1]).toBeGreaterThan(3);
});

test('one steps over a sill, and not over a table', () => {
  expect(
    walked(
      POSE,
      FORWARD,
      3,
      world(() => 0, 2, 0.3),
    ).eyeM[0],
  ).toBeGreaterThan(3);
  expect(
    walked(
      POSE,
      FORWARD,
      3,
      world(() => 0, 2, 0.75),
    ).eyeM[0],
  ).toBeLessThan(2);
});

test('one goes up stairs and down again, the eye as high above each tread', () => {
  const stairs = (x: number): number => 0.18 * Math.floor(Math.max(0, x) / 0.3);
  const up = walked(POSE, FORWARD, 3, world(stairs));
  expect(up.eyeM[0]).toBeGreaterThan(4);
  expect(up.eyeM[2]).toBeCloseTo(stairs(up.eyeM[0]) + 1.65);
  const down = walked({ ...up, headingRad: Math.PI }, FORWARD, 3, world(stairs));
  expect(down.eyeM[2]).toBeLessThan(1.9);
});

test('one does not walk off an edge, nor where nothing is', () => {
  expect(
    walked(
      POSE,
      FORWARD,
      5,
      world((x) => (x < 2 ? 0 : -3)),
    ).eyeM[0],
  ).toBeLessThanOrEqual(2);
  expect(
    walked(
      POSE,
      FORWARD,
      5,
      world((x) => (x < 2 ? 0 : null)),
    ).eyeM[0],
  ).toBeLessThanOrEqual(2);
  expect(
    standing(
      POSE,
      9,
      9,
      world(() => null),
    ),
  ).toBeNull();
});

test('one looks where one is turned, and not beyond straight up', () => {
  expect(targetOf(turned(POSE, Math.PI / 2, 0))[1]).toBeCloseTo(1);
  expect(targetOf(turned(POSE, 0, 9))[2]).toBeGreaterThan(2.5);
  expect(turned(POSE, 0, 9).pitchRad).toBeLessThan(Math.PI / 2);
});

test('on a map one goes to ground of its floor, but not where a wall leaves no room', () => {
  const stairs = world((x) => (x < 5 ? 0 : x < 6 ? 0.4 : null), 3);
  expect(standingOnMap(POSE, 2, 7, 0, stairs)?.eyeM).toEqual([2, 7, 1.65]);
  expect(standingOnMap(POSE, 2.9, 7, 0, stairs)).toBeNull();
  expect(standingOnMap(POSE, 5.5, 0, 0, stairs)?.eyeM[2]).toBeCloseTo(2.05);
  expect(standingOnMap(POSE, 8, 0, 0, stairs)).toBeNull();
});
