/** Whose ground surface is as the review leaves it: the plan's ground, and the review's picks one after the other. */

import type { Review } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { normalOf } from '../load/edges.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { coplanarRegion } from './coplanar-region.ts';
import { type DraftStation, localOf } from './draft.ts';
import { triangleAt } from './triangle-at.ts';

/** Layers of one floor, as a covering on its slab, lie so near to each other. */
const LAYERS_M = 0.35;
/** How far a sensor is above its floor at most, where its height is not known. */
const STOREY_M = 3;
const ON_EDGE = 1e-6;

/** Id of a floor; `SOME_FLOOR`: marked without saying of which, so the planner chooses; null: no ground. */
export type GroundOf = string | null;
const SOME_FLOOR = '';
/** Of a floor that is ground: undersides of walls that stand flush on it are in its plane too, and bear nobody. */
const NEARLY_ALL = 0.8;

/** What each triangle of a region is ground of; docs/method/floor-picking.md has the rules. */
export function groundOfRegion(region: readonly number[], { stage }: LoadedPlan, review: Review | null): GroundOf[] {
  const { triangles, floors, offsetM } = stage;
  const idOf = new Map(floors.map(({ index, id }) => [index + 1, id]));
  const ground = new Map<number, GroundOf>(region.map((t) => [t, idOf.get(triangles.groundOf[t]) ?? null]));
  for (const { point_m, is_ground, floor } of Object.values(review?.ground_picks ?? {})) {
    const at = triangleAt(triangles.cornersM, localOf(point_m, offsetM));
    if (at === null) continue;
    for (const t of coplanarRegion(triangles.cornersM, at)) {
      const before = ground.get(t);
      if (before === undefined) continue;
      if (is_ground) ground.set(t, floor || (before ?? SOME_FLOOR));
      else if (floor === '' || before === floor || before === SOME_FLOOR) ground.set(t, null);
    }
  }
  return region.map((t) => ground.get(t) ?? null);
}

/** Ids of the stations that stand on a region, without scanned ones, which stay. `floorId` '': of whichever floor. */
export function standingOn(
  region: readonly number[],
  { stage }: LoadedPlan,
  stations: readonly DraftStation[],
  floorId: string,
): string[] {
  const { cornersM } = stage.triangles;
  return stations
    .filter(({ isRemoved, isFixed }) => !isRemoved && !isFixed)
    .filter((station) => floorId === '' || station.floorId === floorId)
    .filter(({ positionM, instrumentHeightM }) => {
      const [x, y, z] = localOf(positionM, stage.offsetM);
      const footM = z - (instrumentHeightM ?? 0);
      return region.some((triangle) => {
        const groundM = heightAt(cornersM, triangle, x, y);
        return groundM !== null && Math.abs(footM - groundM) <= (instrumentHeightM === null ? STOREY_M : LAYERS_M);
      });
    })
    .map(({ id }) => id);
}

/** Of a triangle above or below a place in plan; null: it is not there. */
function heightAt(cornersM: Float32Array, triangle: number, x: number, y: number): number | null {
  const at = 9 * triangle;
  const [ax, ay, az] = cornersM.subarray(at, at + 3);
  const [bx, by, bz] = cornersM.subarray(at + 3, at + 6);
  const [cx, cy, cz] = cornersM.subarray(at + 6, at + 9);
  const twice = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
  if (twice === 0) return null;
  const v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / twice;
  const w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / twice;
  // A place on the edge between two of them is on both.
  return v < -ON_EDGE || w < -ON_EDGE || v + w > 1 + ON_EDGE ? null : az + v * (bz - az) + w * (cz - az);
}

/** Why a click changes nothing, in words; null: it does. `floorId` '': of whichever floor. */
export function nothingToPick(
  region: readonly number[],
  loaded: LoadedPlan,
  review: Review | null,
  isGround: boolean,
  floorId: string,
): string | null {
  const ground = groundOfRegion(region, loaded, review);
  const isOf = (of: GroundOf): boolean => of !== null && (floorId === '' || of === floorId || of === SOME_FLOOR);
  const nameOf = (id: GroundOf): string => loaded.plan.floors.find((floor) => floor.id === id)?.name ?? '';
  if (isGround) {
    const { cornersM } = loaded.stage.triangles;
    const areasM2 = region.map((triangle) => Math.hypot(...normalOf(cornersM, triangle)) / 2);
    const isOfM2 = areasM2.reduce((sum, areaM2, i) => sum + (isOf(ground[i]) ? areaM2 : 0), 0);
    const allM2 = areasM2.reduce((sum, areaM2) => sum + areaM2, 0);
    if (isOfM2 < NEARLY_ALL * allM2) return null;
    const name = nameOf(floorId || (ground.find((of) => of !== null) ?? ''));
    return name === ''
      ? t('Already a walkable floor: nothing to mark.')
      : t('Already a walkable floor of {name}: nothing to mark.', { name });
  }
  if (ground.some(isOf)) return null;
  if (floorId === '') return t('Not a walkable floor: nothing to unmark.');
  return t('Not a walkable floor of {name}: nothing to unmark.', { name: nameOf(floorId) });
}
