import { expect, test } from 'vitest';
import type { Stage } from '../load/stage.ts';
import { sectionLines } from './section-lines.ts';

const FLOOR = { id: 'F0', name: '', index: 0, elevationM: 1, topM: 4, groundAreaM2: 1 };

function stageOf(corners: number[]): Stage {
  const cornersM = Float32Array.from(corners);
  return {
    triangles: { count: corners.length / 9, cornersM },
    floors: [FLOOR],
    offsetM: [100, 200, 5],
  } as unknown as Stage;
}

test('a wall is drawn where the level cut meets it, in the scene frame', () => {
  // Upright in the plane x = 2, from z = 1 to z = 3: cut at 2.2.
  const wall = [2, 0, 1, 2, 10, 1, 2, 0, 3];
  const [x1, y1, x2, y2] = sectionLines(stageOf(wall), 'F0');
  expect([x1, x2]).toEqual([102, 102]);
  expect([y1, y2].sort((a, b) => a - b)[0]).toBeCloseTo(200, 6);
  expect([y1, y2].sort((a, b) => a - b)[1]).toBeCloseTo(204, 5);
});

test('what lies above, below or on the level is not drawn', () => {
  const level = 2.2;
  const flat = (z: number): number[] => [0, 0, z, 1, 0, z, 0, 1, z];
  const lines = sectionLines(stageOf([...flat(0), ...flat(5), ...flat(Math.fround(level))]), 'F0');
  expect(lines).toEqual([]);
  expect(sectionLines(stageOf(flat(0)), 'F9')).toEqual([]);
});
