import { expect, test, vi } from 'vitest';
import { WHOLE_BUILDING } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { Building } from './building.ts';

/** Two storeys of so many triangles that each is a piece of its own. */
function twoStoreys(): Building {
  const each = 33_000;
  const count = 2 * each;
  const cornersM = new Float32Array(9 * count);
  for (let i = 2; i < cornersM.length; i += 3) cornersM[i] = i < 9 * each ? 1 : 4;
  const element = (first: number) => ({
    sceneIndex: 0,
    name: '',
    kind: '',
    floorId: '',
    firstTriangle: first,
    nTriangles: each,
  });
  return new Building({
    stage: {
      triangles: {
        count,
        cornersM,
        squaredEdgesM2: new Float32Array(3 * count),
        element: new Int32Array(count),
        firstPatch: new Int32Array(count),
        patchDepth: new Uint8Array(count),
        groundOf: new Uint8Array(count),
      },
      elements: [element(0), element(each)],
    },
    edges: { linesM: new Float32Array(0), bodySide: new Int8Array(count) },
    patchSeen: new Uint8Array(1),
  } as unknown as LoadedPlan);
}

test('a slice draws what it reaches, and the rest gives its graphics memory back', () => {
  const building = twoStoreys();
  const meshes = () => building.group.children as unknown as { geometry: { dispose(): void } }[];
  building.setSlices([WHOLE_BUILDING]);
  const both = [...new Set(meshes().map(({ geometry }) => geometry))];
  expect(both).toHaveLength(2);
  const disposals = both.map((geometry) => vi.spyOn(geometry, 'dispose'));
  building.setSlices([{ ...WHOLE_BUILDING, floorId: 'F0', bottomM: -0.3, topM: 1.6 }]);
  expect(new Set(meshes().map(({ geometry }) => geometry))).toEqual(new Set([both[0]]));
  expect(disposals.map((spy) => spy.mock.calls.length)).toEqual([0, 1]);
  building.setSlices([WHOLE_BUILDING]);
  expect(new Set(meshes().map(({ geometry }) => geometry))).toEqual(new Set(both));
});

test('marked patches are drawn once more, through what hides them, only while there are marks', () => {
  const building = twoStoreys();
  building.setSlices([WHOLE_BUILDING]);
  const hidden = () => building.group.children.filter(({ visible }) => !visible).length;
  expect(hidden()).toBe(2);
  building.setMarks(Uint8Array.of(1));
  expect(hidden()).toBe(0);
  building.setSlices([WHOLE_BUILDING]);
  expect(hidden()).toBe(0);
  building.setMarks(null);
  expect(hidden()).toBe(2);
});

test('values of one layer give way to those of the next, and all is disposed of', () => {
  const building = twoStoreys();
  building.setValues(Uint16Array.of(7));
  building.setValues(Uint8Array.of(7));
  building.setValues(null);
  building.setSlices([WHOLE_BUILDING]);
  building.dispose();
  expect(building.group.children).toHaveLength(0);
});
