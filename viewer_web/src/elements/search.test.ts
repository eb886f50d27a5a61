import { expect, test } from 'vitest';
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { boxOfElement, foundElements } from './search.ts';

const element = (name: string, kind: string, sourceId: string): StageElement =>
  ({ name, kind, sourceId, firstTriangle: 1, nTriangles: 1 }) as StageElement;
const ELEMENTS = [
  element('Upper wall south', 'IfcWallStandardCase', '0abcDEF'),
  element('Door hall', 'IfcDoor', '1Yx$wall'),
  element('Wall south', 'IfcWall', '2Q'),
];
const namesOf = (typed: string) => foundElements(ELEMENTS, typed).map((index) => ELEMENTS[index].name);

test('elements are found by name, class in words, or GlobalId, those that begin so first', () => {
  expect(namesOf('wall south')).toEqual(['Wall south', 'Upper wall south']);
  expect(namesOf('STANDARD case')).toEqual(['Upper wall south']);
  expect(namesOf('1yx$')).toEqual(['Door hall']);
  expect(namesOf('ifcdoor hall')).toEqual(['Door hall']);
  expect(namesOf('window')).toEqual([]);
  expect(namesOf('  ')).toEqual([]);
});

test('the box of an element is that of its own triangles', () => {
  const corners = [9, 9, 9, 9, 9, 9, 9, 9, 9, 0, 1, 2, 3, -1, 2, 1, 1, 5];
  expect(boxOfElement(ELEMENTS[0], { cornersM: Float32Array.from(corners) } as StageTriangles)).toEqual([
    [0, -1, 2],
    [3, 1, 5],
  ]);
});
