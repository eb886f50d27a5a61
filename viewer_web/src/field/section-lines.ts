/** The walls of a floor as a map has them: where a level cut meets the building. */
import type { Stage } from '../load/stage.ts';

/** Above furniture and sills, below the tops of doors. */
const CUT_ABOVE_GROUND_M = 1.2;
/** More lines are too many for a drawing. */
const MOST_LINES = 60_000;

/** Ends x1, y1, x2, y2 of each line, scene frame; none where the building is too fine for a drawing. */
export function sectionLines({ triangles, floors, offsetM }: Stage, floorId: string): readonly number[] {
  const floor = floors.find(({ id }) => id === floorId);
  if (floor === undefined) return [];
  const lines: number[] = [];
  for (let t = 0; t < triangles.count; t++) {
    cut(triangles.cornersM, 9 * t, floor.elevationM + CUT_ABOVE_GROUND_M, offsetM, lines);
    if (lines.length > 4 * MOST_LINES) return [];
  }
  return lines;
}

/** Add the line in which a triangle meets the level. A corner on the level counts as above it, so that no line comes twice. */
function cut(corners: Float32Array, at: number, levelM: number, offsetM: readonly number[], lines: number[]): void {
  const ends: number[] = [];
  for (let k = 0; k < 3; k++) {
    const [a, b] = [at + 3 * k, at + 3 * ((k + 1) % 3)];
    const [za, zb] = [corners[a + 2] - levelM, corners[b + 2] - levelM];
    if (za >= 0 === zb >= 0) continue;
    const share = za / (za - zb);
    ends.push(
      corners[a] + share * (corners[b] - corners[a]) + offsetM[0],
      corners[a + 1] + share * (corners[b + 1] - corners[a + 1]) + offsetM[1],
    );
  }
  if (ends.length === 4) lines.push(...ends);
}
