import { expect, test } from 'vitest';
import type { StageElement } from '../load/stage.ts';
import { doorAt, doorsOf } from './doors.ts';

/** A leaf of one upright triangle, 0.9 m wide, from (x, y). */
const leaf = (x: number, y: number): number[] => [x, y, 0, x + 0.9, y, 0, x + 0.9, y + 0.05, 2];
const element = (sceneIndex: number, kind: string, firstTriangle: number, nTriangles = 1): StageElement => ({
  sceneIndex,
  name: '',
  kind,
  sourceId: `id ${sceneIndex}`,
  floorId: 'F0',
  file: 0,
  firstTriangle,
  nTriangles,
});
const WALL = element(3, 'IfcWall', 0);
const elements = [WALL, element(5, 'IfcDoor', 1), element(8, 'IfcDoor', 2), element(9, 'IfcDoor', 3, 0)];
const doors = doorsOf({
  elements,
  triangles: { cornersM: Float32Array.from([...leaf(0, 0), ...leaf(2, 1), ...leaf(4, 1)]) },
});

test('doors that are drawn are found with their boxes', () => {
  expect(doors.map(({ element }) => element.sceneIndex)).toEqual([5, 8]);
  expect([...doors[0].lowM, ...doors[0].highM].map((m) => Math.round(1000 * m))).toEqual([
    2000, 1000, 0, 2900, 1050, 2000,
  ]);
});

test('a click means the clicked door, else the nearest one within reach', () => {
  expect(doorAt(doors, elements[2], [2.5, 1, 1])?.element.sceneIndex).toBe(8);
  expect(doorAt(doors, WALL, [3.1, 1, 1])?.element.sceneIndex).toBe(5);
  expect(doorAt(doors, WALL, [3.7, 1, 1])?.element.sceneIndex).toBe(8);
  expect(doorAt(doors, WALL, [2.5, 1.5, 1])).toBeNull();
  expect(doorAt(doors, WALL, [2.5, 1, 2.5])).toBeNull();
  expect(doorAt([], WALL, [0, 0, 0])).toBeNull();
});
