import { PerspectiveCamera, Vector3 } from 'three';
import { expect, test } from 'vitest';
import type { Extent } from '../floors/cut.ts';
import { flightAt, homeView, orbited, type Whence } from './camera.ts';

const BOXES: Extent[] = [
  { minM: [0, 0, 0], maxM: [10, 8, 6] },
  { minM: [-3, 5, 20], maxM: [90, 7, 21] },
  { minM: [0, 0, 0], maxM: [2, 2, 60] },
];

const WHENCE: readonly Whence[] = ['side', 'top', '+x', '-x', '+y', '-y'];

test.each(WHENCE)('the view from the %s has the whole box in the picture', (from) => {
  for (const aspect of [0.5, 1, 2.2]) {
    for (const box of BOXES) {
      const view = homeView(box, from, { fieldOfViewDeg: 34, aspect });
      const camera = new PerspectiveCamera(34, aspect, 0.01, 1e4);
      camera.up.set(0, 0, 1);
      camera.position.copy(view.position);
      camera.lookAt(view.target);
      camera.updateMatrixWorld();
      let furthest = 0;
      for (let i = 0; i < 8; i++) {
        const pick = (axis: number): number => (i & (1 << axis) ? box.maxM : box.minM)[axis];
        const at = new Vector3(pick(0), pick(1), pick(2)).project(camera);
        furthest = Math.max(furthest, Math.abs(at.x), Math.abs(at.y));
      }
      expect(furthest).toBeLessThan(1);
      expect(furthest).toBeGreaterThan(0.5);
    }
  }
});

test.each([
  { right: 0.3, top: 0.2, bottom: 0 },
  { right: 0, top: 0.1, bottom: 0.3 },
])('what panels cover at the right, above and below stays free of the box: %o', (covered) => {
  for (const from of ['side', 'top'] as const) {
    for (const box of BOXES) {
      const view = homeView(box, from, { fieldOfViewDeg: 34, aspect: 1.5 }, covered);
      const camera = new PerspectiveCamera(34, 1.5, 0.01, 1e4);
      camera.up.set(0, 0, 1);
      camera.position.copy(view.position);
      camera.lookAt(view.target);
      camera.updateMatrixWorld();
      const corners = [...Array(8).keys()].map((i) =>
        new Vector3(...[0, 1, 2].map((axis) => (i & (1 << axis) ? box.maxM : box.minM)[axis])).project(camera),
      );
      const [xs, ys] = [corners.map(({ x }) => x), corners.map(({ y }) => y)];
      expect(Math.min(...xs)).toBeGreaterThan(-1);
      expect(Math.max(...xs)).toBeLessThan(1 - 2 * covered.right);
      expect(Math.min(...ys)).toBeGreaterThan(-1 + 2 * covered.bottom);
      expect(Math.max(...ys)).toBeLessThan(1 - 2 * covered.top);
    }
  }
});

test('a flight begins where it was, ends where it goes, and says so', () => {
  const at = (x: number) => ({ position: new Vector3(x, 0, 0), target: new Vector3(0, x, 0) });
  const flight = { from: at(0), to: at(10), start: 100, durationMs: 200 };
  expect(flightAt(flight, 100).view.position.x).toBe(0);
  expect(flightAt(flight, 200).view.position.x).toBeCloseTo(5);
  expect(flightAt(flight, 200).isOver).toBe(false);
  expect(flightAt(flight, 300)).toMatchObject({ isOver: true, view: { target: { y: 10 } } });
});

test('a flight to the other side goes round what is looked at, the shorter way', () => {
  const from = { position: new Vector3(-1, -10, 0), target: new Vector3() };
  const to = { position: new Vector3(-1, 10, 0), target: new Vector3() };
  const half = flightAt({ from, to, start: 0, durationMs: 2 }, 1).view.position;
  expect(half.toArray()).toEqual([expect.closeTo(-Math.hypot(1, 10)), expect.closeTo(0), expect.closeTo(0)]);
});

test('the camera goes round what it looks at, keeps its distance, and stops short of straight above', () => {
  const view = { position: new Vector3(4, -3, 5), target: new Vector3(4, 0, 1) };
  const quarter = orbited(view, Math.PI / 2, 0, 1);
  // From the south to the east, at the same height.
  expect(quarter).toEqual([expect.closeTo(7), expect.closeTo(0), expect.closeTo(5)]);
  const above = orbited(view, 0, -2, 1);
  expect(above).toEqual([expect.closeTo(4), expect.closeTo(0, 1), expect.closeTo(6)]);
  expect(above[1]).toBeLessThan(0);
  expect(orbited(view, 0, 0, 0.5)).toEqual([expect.closeTo(4), expect.closeTo(-1.5), expect.closeTo(3)]);
});
