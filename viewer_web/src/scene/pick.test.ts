import { BufferAttribute, BufferGeometry, Ray, Vector3 } from 'three';
import { MeshBVH } from 'three-mesh-bvh';
import { expect, test } from 'vitest';
import { createFileState, hiddenTriangles } from '../files/state.ts';
import { type Slice, WHOLE_BUILDING } from '../floors/cut.ts';
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { SurfacePicker } from './pick.ts';

/** A level square of two triangles at a height, and an upright one across x. */
const level = (z: number): number[] => [-5, -5, z, 5, -5, z, 5, 5, z, -5, -5, z, 5, 5, z, -5, 5, z];
const upright = (x: number): number[] => [x, -5, 0, x, 5, 0, x, 5, 3, x, -5, 0, x, 5, 3, x, -5, 3];
const CORNERS = Float32Array.from([...level(0), ...level(2.5), ...upright(2), ...upright(4)]);

function picker(): SurfacePicker {
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(CORNERS, 3));
  return new SurfacePicker(CORNERS, MeshBVH.serialize(new MeshBVH(geometry, { indirect: true })));
}
const DOWN = new Ray(new Vector3(0.3, 0.2, 10), new Vector3(0, 0, -1));
const ACROSS = new Ray(new Vector3(0, 0.3, 1), new Vector3(1, 0, 0));
const cut: Slice = { ...WHOLE_BUILDING, floorId: 'F0', bottomM: -0.3, topM: 1.6 };

test('what a slice cuts away is not hit, and a lifted slice is hit where it is drawn', () => {
  const pick = picker();
  expect(pick.firstHit(DOWN, [WHOLE_BUILDING])?.distanceM).toBeCloseTo(7.5);
  expect(pick.firstHit(DOWN, [cut])?.distanceM).toBeCloseTo(10);
  const lifted = pick.firstHit(DOWN, [{ ...cut, liftM: 4 }]);
  expect(lifted?.distanceM).toBeCloseTo(6);
  expect(lifted?.pointM.z).toBeCloseTo(0);
  expect(pick.firstHit(DOWN, [cut, { ...cut, liftM: 4 }])?.distanceM).toBeCloseTo(6);
});

test('hidden ceilings are not hit, and what stands upright above their height is', () => {
  const open = { ...WHOLE_BUILDING, ceilingM: 0.5 };
  const pick = picker();
  expect(pick.firstHit(DOWN, [open])?.distanceM).toBeCloseTo(10);
  expect(pick.firstHit(ACROSS, [open])?.distanceM).toBeCloseTo(2);
});

test('a ray goes on behind what is passed', () => {
  const pick = picker();
  const isFirstWall = (triangle: number): boolean => triangle === 4 || triangle === 5;
  expect(pick.firstHit(ACROSS, [WHOLE_BUILDING], 99, isFirstWall)?.distanceM).toBeCloseTo(4);
  expect(pick.firstHit(ACROSS, [WHOLE_BUILDING], 3, isFirstWall)).toBeNull();
});

test('of a file that is switched off nothing is hit, however much of it lies in front', () => {
  const hidden = Array.from({ length: 120 }, (_, i) => upright(0.1 + 0.01 * i)).flat();
  const corners = Float32Array.from([...hidden, ...upright(4)]);
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(corners, 3));
  const pick = new SurfacePicker(corners, MeshBVH.serialize(new MeshBVH(geometry, { indirect: true })));
  const files = createFileState();
  const isHidden = hiddenTriangles(files, {
    triangles: { element: Int32Array.from({ length: 242 }, (_, t) => (t < 240 ? 0 : 1)) } as StageTriangles,
    elements: [{ file: 1 } as StageElement, { file: 0 } as StageElement],
  });
  const distance = () => pick.firstHit(ACROSS, [WHOLE_BUILDING], 99, isHidden)?.distanceM;
  expect(distance()).toBeCloseTo(0.1);
  files.hiddenFiles.value = new Set([1]);
  expect(distance()).toBeCloseTo(4);
});

test('nothing is hit beyond the far end, nor level with a slice that lies elsewhere', () => {
  const pick = picker();
  expect(pick.firstHit(ACROSS, [WHOLE_BUILDING], 1.9)).toBeNull();
  expect(pick.firstHit(ACROSS, [{ ...cut, topM: 0.9 }])).toBeNull();
});
