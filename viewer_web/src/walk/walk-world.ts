/** The building as it is under the feet and in the way of a person who walks: all of it, doors open. */
import { Ray, Vector3 } from 'three';
import { WHOLE_BUILDING } from '../floors/cut.ts';
import type { Stage } from '../load/stage.ts';
import type { SurfaceHit, SurfacePicker } from '../scene/pick.ts';
import type { WalkWorld } from './walker.ts';

/** Further ahead nobody gets with one step. */
const AHEAD_M = 2;

export function walkWorld(picker: SurfacePicker, { elements, floors, triangles }: Stage): WalkWorld {
  // Closed in the model, and opened by who walks.
  const isDoor = (triangle: number): boolean => /door/i.test(elements[triangles.element[triangle]].kind);
  const hit = (origin: Vector3, direction: Vector3, farM: number): SurfaceHit | null =>
    picker.firstHit(new Ray(origin, direction), [WHOLE_BUILDING], farM, isDoor);
  const first = (origin: Vector3, direction: Vector3, farM: number): number | null =>
    hit(origin, direction, farM)?.distanceM ?? null;
  const down = new Vector3(0, 0, -1);
  return {
    groundBelow: (x, y, z, depthM) => {
      const farM = first(new Vector3(x, y, z), down, depthM);
      return farM === null ? null : z - farM;
    },
    floorBelow: (x, y, z, depthM) => {
      const below = hit(new Vector3(x, y, z), down, depthM);
      const floor = below && floors.find(({ index }) => index + 1 === triangles.groundOf[below.triangle]);
      return below && floor ? { heightM: below.pointM.z, floorId: floor.id } : null;
    },
    freeAhead: ([x, y, z], [dx, dy]) =>
      first(new Vector3(x, y, z), new Vector3(dx, dy, 0), AHEAD_M) ?? Number.POSITIVE_INFINITY,
  };
}
