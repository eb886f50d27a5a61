import { PerspectiveCamera, Vector3 } from 'three';
import { expect, test } from 'vitest';
import type { Extent } from '../floors/cut.ts';
import { flightAt, homeView } from './camera.ts';

const BOXES: Extent[] = [
  { minM: [0, 0, 0], maxM: [10, 8, 6] },
  { minM: [-3, 5, 20], maxM: [90, 7, 21] },
  { minM: [0, 0, 0], maxM: [2, 2, 60] },
];

test.each(['side', 'top'] as const)('the view from the %s has the whole box in the picture', (from) => {
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

test('a flight begins where it was, ends where it goes, and says so', () => {
  const at = (x: number) => ({ position: new Vector3(x, 0, 0), target: new Vector3(0, x, 0) });
  const flight = { from: at(0), to: at(10), start: 100, durationMs: 200 };
  expect(flightAt(flight, 100).view.position.x).toBe(0);
  expect(flightAt(flight, 200).view.position.x).toBeCloseTo(5);
  expect(flightAt(flight, 200).isOver).toBe(false);
  expect(flightAt(flight, 300)).toMatchObject({ isOver: true, view: { target: { y: 10 } } });
});
