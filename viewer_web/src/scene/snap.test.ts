import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Line3,
  OrthographicCamera,
  Ray,
  Raycaster,
  Vector2,
  Vector3,
} from 'three';
import { MeshBVH } from 'three-mesh-bvh';
import { expect, test } from 'vitest';
import { type Slice, WHOLE_BUILDING } from '../floors/cut.ts';
import { findEdges } from '../load/edges.ts';
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { planesOfBox } from '../section/planes.ts';
import { SurfacePicker } from './pick.ts';
import { nearestOnLine, type Picture, Snapper, shownOf } from './snap.ts';

/** A wall of 4 x 0.2 x 3 m on a slab of 10 x 10 m whose top is at 0. */
function box(minM: readonly number[], maxM: readonly number[]): number[] {
  const size = minM.map((x, k) => maxM[k] - x);
  const geometry = new BoxGeometry(size[0], size[1], size[2]).toNonIndexed();
  geometry.translate(minM[0] + size[0] / 2, minM[1] + size[1] / 2, minM[2] + size[2] / 2);
  return [...geometry.getAttribute('position').array];
}
const CORNERS = Float32Array.from([...box([1, 2, 0], [5, 2.2, 3]), ...box([-5, -5, -0.3], [5, 5, 0])]);
const elements = [0, 12].map((firstTriangle) => ({ firstTriangle, nTriangles: 12 }) as StageElement);
const triangles = {
  count: 24,
  cornersM: CORNERS,
  element: Int32Array.from({ length: 24 }, (_, t) => (t < 12 ? 0 : 1)),
} as unknown as StageTriangles;
const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(CORNERS, 3));
const picker = new SurfacePicker(CORNERS, MeshBVH.serialize(new MeshBVH(geometry, { indirect: true })));
const loaded = { stage: { triangles, elements }, edges: findEdges(triangles, elements) };
const snapper = new Snapper(picker, loaded as never, () => false);

/** From above, 100 pixels a metre, (0, 0) of the scene at (500, 500). */
const camera = new OrthographicCamera(-5, 5, 5, -5, -50, 50);
camera.updateMatrixWorld();
camera.updateProjectionMatrix();
const picture: Picture = {
  rayAt: (x, y) => {
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(x / 500 - 1, 1 - y / 500), camera);
    caster.ray.origin.z = 50;
    return caster.ray;
  },
  rayTo: ({ x, y, z }) => ({ ray: new Ray(new Vector3(x, y, 50), new Vector3(0, 0, -1)), distanceM: 50 - z }),
  project: ({ x, y }) => ({ x: 500 + 100 * x, y: 500 - 100 * y }),
  metresPerPixel: () => 0.01,
};
const cut: Slice = { ...WHOLE_BUILDING, floorId: 'F0', bottomM: -0.3, topM: 1.6 };
const at = (x: number, y: number, slices: readonly Slice[] = [cut]) =>
  snapper.snapAt(500 + 100 * x, 500 - 100 * y, picture, slices);

test('near a corner of a wall that a cut opens, the corner is meant', () => {
  // From four sides of it, on the wall, and beside it on the slab.
  for (const [dx, dy] of [
    [0.05, 0.03],
    [-0.06, -0.04],
    [0.04, -0.05],
    [-0.05, 0.05],
  ]) {
    const found = at(1 + dx, 2 + dy);
    expect(found?.kind, `${dx} ${dy}`).toBe('corner');
    expect([found?.pointM.x, found?.pointM.y]).toEqual([expect.closeTo(1, 5), expect.closeTo(2, 5)]);
  }
});

test('along the wall its edge is meant, on the cut as well as at its foot; further off the surface is', () => {
  const found = at(3.3, 2.25);
  expect(found?.kind).toBe('edge');
  expect(found?.pointM.toArray().slice(0, 2)).toEqual([expect.closeTo(3.3, 5), expect.closeTo(2.2, 5)]);
  const free = at(3.3, 3);
  expect(free?.kind).toBe('surface');
  expect(free?.pointM.toArray()).toEqual([expect.closeTo(3.3), expect.closeTo(3), expect.closeTo(0)]);
  expect(at(7, 7)).toBeNull();
});

test('what a section takes away is not snapped to, and where it ends an edge is a corner', () => {
  const half: Slice = { ...cut, planes: planesOfBox({ minM: [-9, -9, -9], maxM: [3, 9, 9] }) };
  const end = at(2.96, 2.24, [half]);
  expect(end?.kind).toBe('corner');
  expect(end?.pointM.toArray().slice(0, 2)).toEqual([expect.closeTo(3, 5), expect.closeTo(2.2, 5)]);
  expect(at(4.97, 2.23, [half])).toBeNull();
});

test('what lies hidden is not snapped to', () => {
  // The lower edges of the slab lie under its upper ones; the one of the wall's foot lies inside the picture of its top.
  const found = at(-4.96, -4.97, [WHOLE_BUILDING]);
  expect(found?.kind).toBe('corner');
  expect(found?.pointM.z).toBeCloseTo(0);
});

test('of a line the part in the slice is left, and the place nearest to a ray is on it', () => {
  const line = new Line3(new Vector3(0, 0, -1), new Vector3(0, 0, 3));
  const shown = shownOf(line, cut);
  expect([shown?.start.z, shown?.end.z]).toEqual([expect.closeTo(-0.3), expect.closeTo(1.6)]);
  expect(shownOf(new Line3(new Vector3(0, 0, 2), new Vector3(1, 0, 3)), cut)).toBeNull();
  // Skew lines: x axis, and a ray along y at x = 2 that passes 1 above.
  const x = new Line3(new Vector3(0, 0, 0), new Vector3(5, 0, 0));
  const skew = new Ray(new Vector3(2, -3, 1), new Vector3(0, 1, 0));
  expect(nearestOnLine(skew, x).toArray()).toEqual([expect.closeTo(2), 0, 0]);
  expect(nearestOnLine(new Ray(new Vector3(9, -3, 1), new Vector3(0, 1, 0)), x).x).toBe(5);
  expect(nearestOnLine(new Ray(new Vector3(0.1, 0, 9), new Vector3(0, 0, -1)), line).z).toBe(3);
});
