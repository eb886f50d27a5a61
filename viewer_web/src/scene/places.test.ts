import { type Ray, Vector3 } from 'three';
import { expect, test } from 'vitest';
import { patchCode, patchCorners, squaredEdges } from '../load/patch-rule.ts';
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { PatchPlaces } from './patch-places.ts';
import { partsOf } from './piece-parts.ts';
import { type PieceToSee, type Surroundings, viewOf } from './viewpoint.ts';

/** Triangles by their corners, patches numbered in the order of `firstPatch`. */
function triangles(corners: number[][], depth: number[], firstPatch: number[]): StageTriangles {
  const cornersM = Float32Array.from(corners.flat());
  return {
    count: corners.length,
    cornersM,
    squaredEdgesM2: Float32Array.from(corners.flatMap((_, t) => squaredEdges(cornersM, 9 * t))),
    element: new Int32Array(corners.length),
    firstPatch: Int32Array.from(firstPatch),
    patchDepth: Uint8Array.from(depth),
    groundOf: new Uint8Array(corners.length),
  };
}
const FLAT = [0, 0, 0, 4, 0, 0, 0, 3, 0];
const UPRIGHT = [0, 0, 0, 0, 2, 0, 0, 0, 2];
const TRIANGLES = triangles([FLAT, UPRIGHT], [5, 3], [8, 0]);
const ELEMENT: StageElement = {
  sceneIndex: 0,
  name: '',
  kind: '',
  sourceId: '',
  floorId: '',
  file: 0,
  firstTriangle: 0,
  nTriangles: 2,
};

test('the middle of every patch has the code of that patch', () => {
  for (const [t, depth] of [
    [0, 5],
    [1, 3],
  ]) {
    const [q01, q12, q20] = TRIANGLES.squaredEdgesM2.subarray(3 * t, 3 * t + 3);
    for (let code = 0; code < 2 ** depth; code++) {
      const c = patchCorners(TRIANGLES.cornersM, 9 * t, [q01, q12, q20], depth, code);
      const middle = [0, 1, 2].map((k) => (c[k] + c[3 + k] + c[6 + k]) / 3);
      // Weights of these two right triangles are coordinates over lengths.
      const [w1, w2] = t === 0 ? [middle[0] / 4, middle[1] / 3] : [middle[1] / 2, middle[2] / 2];
      expect(patchCode([1 - w1 - w2, w1, w2], [q01, q12, q20], depth)).toBe(code);
    }
  }
});

test('patches are found on their triangle, whatever order the triangles are numbered in', () => {
  const places = new PatchPlaces(TRIANGLES);
  expect([0, 7, 8, 39].map((patch) => places.triangleOf(patch))).toEqual([1, 1, 0, 0]);
  expect([40, 1000].map((patch) => places.triangleOf(patch))).toEqual([-1, -1]);
  expect(places.placeOf(40)).toBeNull();
  expect(places.placeOf(20)?.normal.toArray()).toEqual([0, 0, 1]);
  expect(places.placeOf(3)?.normal.toArray()).toEqual([1, 0, 0]);
});

test('of an element the patches in a box are found that are asked for', () => {
  const places = new PatchPlaces(TRIANGLES);
  const all = places.patchesIn(
    ELEMENT,
    [
      [-1, -1, -1],
      [9, 9, 9],
    ],
    () => true,
  );
  expect(all.sort((a, b) => a - b)).toEqual([...Array(40).keys()]);
  const upright = places.patchesIn(
    ELEMENT,
    [
      [-1, -1, 0.01],
      [9, 9, 9],
    ],
    () => true,
  );
  expect(upright.every((patch) => patch < 8)).toBe(true);
  expect(upright.length).toBe(8);
  expect(
    places.patchesIn(
      ELEMENT,
      [
        [-1, -1, -1],
        [9, 9, 9],
      ],
      (patch) => patch === 11,
    ),
  ).toEqual([11]);
});

const AT = new Vector3(0, 0, 0);
const UP = new Vector3(0, 0, 1);
const NOWHERE = Number.POSITIVE_INFINITY;
const piece = (sizeM: number, normal = UP, isOneSided = false): PieceToSee => ({
  parts: [{ pointM: AT, normal }],
  isOneSided,
  sizeM,
});
/** So far one gets in each direction, and nothing lies in between that is not that near. */
const around = (freeLength: (direction: Vector3) => number): Surroundings => ({
  freeLength: ({ direction }) => freeLength(direction),
  freePastItself: ({ direction }) => freeLength(direction),
  isOpen: (from, to) => from.distanceTo(to) < freeLength(from.clone().sub(to).normalize()),
});
const FREE = around(() => NOWHERE);

test('a surface is looked at from the side that is free, at the wished distance', () => {
  const belowIsFree = around(({ z }) => (z > 0 ? 0.05 : NOWHERE));
  const view = viewOf(piece(4), belowIsFree);
  expect(view.position.z).toBeLessThan(0);
  const free = viewOf(piece(4), FREE);
  expect(free.position.z).toBeGreaterThan(0);
  expect(free.position.length()).toBeCloseTo(view.position.length());
  expect(free.target.toArray()).toEqual([0, 0, 0]);
});

test('a body is never looked at from its inside, also where that is free', () => {
  const belowIsFree = around(({ z }) => (z > 0 ? 0.05 : NOWHERE));
  const walledIn = { ...belowIsFree, freePastItself: () => 0.05 };
  expect(viewOf(piece(4, UP, true), walledIn).position.z).toBeGreaterThan(0);
  for (const normal of [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, -1, 0), new Vector3(-1, 0, 0)]) {
    for (const where of [FREE, around(() => 0.1)]) {
      expect(viewOf(piece(1, normal, true), where).position.dot(normal), normal.toArray().join()).toBeGreaterThan(0);
    }
  }
});

test('of free views the one is taken that shows most of the piece', () => {
  // Along x a screen stands before the other parts: whoever looks from beyond it sees the middle alone.
  const parts = [0, 1, 2, 3].map((y) => ({ pointM: new Vector3(0, y, 0), normal: UP }));
  const isOpen = (from: Vector3, to: Vector3): boolean => to.y === 0 || from.x < -0.5;
  const view = viewOf({ parts, isOneSided: true, sizeM: 3 }, { ...FREE, isOpen });
  expect(view.position.x).toBeLessThan(-0.5);
});

test('a part of a body counts as seen from its own front alone', () => {
  // An edge: from above the middle only the inside of the steep part would show.
  const steep = { pointM: new Vector3(1, 0, 0), normal: new Vector3(0.995, 0, 0.1) };
  const parts = [{ pointM: AT, normal: UP }, steep, steep];
  const { position } = viewOf({ parts, isOneSided: true, sizeM: 2 }, FREE);
  const fromFront = parts.filter(({ pointM, normal }) => position.clone().sub(pointM).dot(normal) > 0);
  expect(fromFront).toHaveLength(parts.length);
});

test('the camera stops short of what is in the way', () => {
  const view = viewOf(
    piece(2),
    around(() => 3),
  );
  expect(view.position.length()).toBeLessThan(3);
  expect(view.position.length()).toBeGreaterThan(2);
});

test('what no side shows is looked at from outside and above', () => {
  for (const hidden of [around(() => 0.1), { ...around(() => 0.1), freeLength: () => NOWHERE, isOpen: () => false }]) {
    const view = viewOf(piece(4), hidden);
    expect(view.position.length()).toBeGreaterThan(4);
    expect(view.position.z).toBeGreaterThan(0);
  }
});

test('what faces a wall is looked at through its own element, from the room that this stands in', () => {
  const backOfShelf = piece(1, new Vector3(0, -1, 0), true);
  const room = { ...around(() => 0.05), freePastItself: ({ direction }: Ray) => (direction.y > 0.3 ? 4 : 0.05) };
  const { position } = viewOf(backOfShelf, room);
  expect(position.y).toBeGreaterThan(1);
  expect(position.z).toBeGreaterThan(0);
  expect(position.length()).toBeLessThan(4);
});

test('what would fill the picture from within its room is looked at through itself, where there is room', () => {
  const ceiling = piece(8, new Vector3(0, 0, -1), true);
  const room = {
    ...around(({ z }) => (z < 0 ? 2.4 : 0.05)),
    freePastItself: ({ direction }: Ray) => (direction.z > 0 ? NOWHERE : 2.4),
  };
  expect(viewOf(ceiling, room).position.z).toBeGreaterThan(5);
  expect(viewOf({ ...ceiling, sizeM: 2 }, room).position.z).toBeLessThan(0);
  expect(viewOf(ceiling, { ...room, freePastItself: () => 2.4 }).position.z).toBeLessThan(0);
});

test('larger pieces are looked at from further off, within reason', () => {
  const far = (size: number): number => viewOf(piece(size), FREE).position.length();
  expect(far(8)).toBeGreaterThan(far(3));
  expect(far(0.1)).toBeGreaterThan(2);
  expect(far(1000)).toBeLessThan(100);
});

test('a piece is judged by parts in its box that face as its middle, turned to the outside of a body', () => {
  const places = new PatchPlaces(TRIANGLES);
  const offsetM = [100, 200, 0] as const;
  const whole = {
    area_m2: 1,
    centroid: [0, 0, 0],
    patch: 20,
    box: [
      [99, 199, -1],
      [109, 209, 9],
    ],
  } as unknown as Parameters<typeof partsOf>[0];
  const open = partsOf(whole, ELEMENT, { offsetM }, places, new Int8Array(2))!;
  expect(open.isOneSided).toBe(false);
  expect(open.parts.length).toBeGreaterThan(4);
  expect(open.parts.every(({ normal }) => normal.z === 1)).toBe(true);
  expect(open.parts[0].pointM.toArray()).toEqual(places.placeOf(20)!.pointM.toArray());
  const insideOut = partsOf(whole, ELEMENT, { offsetM }, places, Int8Array.of(-1, -1))!;
  expect(insideOut.isOneSided).toBe(true);
  expect(insideOut.parts.every(({ normal }) => normal.z === -1)).toBe(true);
  expect(partsOf({ ...whole, patch: 999 }, ELEMENT, { offsetM }, places, new Int8Array(2))).toBeNull();
});
