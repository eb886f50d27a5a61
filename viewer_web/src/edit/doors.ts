/** The doors of the building: which are drawn, and which one a click means. */
import type { StageElement, StageTriangles } from '../load/stage.ts';

const DOOR_KIND = 'IfcDoor';
/** From above a leaf is thin: a click beside it means it too. */
const REACH_M = 0.4;

/** A door and its box, local metres. */
export interface Door {
  readonly element: StageElement;
  readonly lowM: readonly [number, number, number];
  readonly highM: readonly [number, number, number];
}

interface Building {
  readonly elements: readonly StageElement[];
  readonly triangles: Pick<StageTriangles, 'cornersM'>;
}

export function doorsOf({ elements, triangles: { cornersM } }: Building): Door[] {
  return elements
    .filter(({ kind, nTriangles }) => kind === DOOR_KIND && nTriangles > 0)
    .map((element) => {
      const low = [Infinity, Infinity, Infinity] as [number, number, number];
      const high = [-Infinity, -Infinity, -Infinity] as [number, number, number];
      for (let i = 9 * element.firstTriangle; i < 9 * (element.firstTriangle + element.nTriangles); i++) {
        low[i % 3] = Math.min(low[i % 3], cornersM[i]);
        high[i % 3] = Math.max(high[i % 3], cornersM[i]);
      }
      return { element, lowM: low, highM: high };
    });
}

/** The clicked door, else the nearest one within reach of the clicked place (local metres); null: there is none. */
export function doorAt(doors: readonly Door[], clicked: StageElement, atM: readonly number[]): Door | null {
  const own = doors.find(({ element }) => element.sceneIndex === clicked.sceneIndex);
  if (own !== undefined) return own;
  const away = ({ lowM, highM }: Door): number =>
    Math.hypot(...atM.map((value, k) => Math.max(lowM[k] - value, 0, value - highM[k])));
  const [nearest] = doors.map((door) => ({ door, awayM: away(door) })).sort((a, b) => a.awayM - b.awayM);
  return nearest !== undefined && nearest.awayM <= REACH_M ? nearest.door : null;
}
