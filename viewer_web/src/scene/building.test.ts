import { expect, test, vi } from 'vitest';
import { WHOLE_BUILDING } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { Building } from './building.ts';

/** Two storeys, a file each, of so many triangles that each is a piece of its own, with so many lines. */
function twoStoreys(nLines: readonly [number, number] = [0, 0]): Building {
  const each = 33_000;
  const count = 2 * each;
  const cornersM = new Float32Array(9 * count);
  for (let i = 2; i < cornersM.length; i += 3) cornersM[i] = i < 9 * each ? 1 : 4;
  const element = (first: number, file: number) => ({
    sceneIndex: 0,
    name: '',
    kind: '',
    floorId: '',
    file,
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
      elements: [element(0, 0), element(each, 1)],
    },
    edges: {
      linesM: new Float32Array(6 * (nLines[0] + nLines[1])),
      firstLine: Int32Array.of(0, nLines[0], nLines[0] + nLines[1]),
      bodySide: new Int8Array(count),
    },
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

test('of a hidden file neither faces nor lines nor marks are drawn, and its graphics memory is given back', () => {
  const building = twoStoreys([1, 2]);
  type Drawn = { geometry: { attributes: { position: { count: number } }; dispose(): void } };
  const drawn = () => building.group.children as unknown as Drawn[];
  const corners = () => new Set(drawn().map(({ geometry }) => geometry.attributes.position.count));
  building.setMarks(Uint8Array.of(1));
  building.setSlices([WHOLE_BUILDING]);
  const all = drawn().length;
  const disposals = [...new Set(drawn().map(({ geometry }) => geometry))].map((each) => vi.spyOn(each, 'dispose'));
  expect(corners()).toEqual(new Set([99_000, 2, 4]));
  building.setSlices([WHOLE_BUILDING], new Set([1]));
  expect(drawn()).toHaveLength(all / 2);
  expect(corners()).toEqual(new Set([99_000, 2]));
  expect(disposals.filter((spy) => spy.mock.calls.length > 0)).toHaveLength(2);
  building.setSlices([WHOLE_BUILDING], new Set([0, 1]));
  expect(drawn()).toHaveLength(0);
  building.setSlices([WHOLE_BUILDING]);
  expect(drawn()).toHaveLength(all);
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
