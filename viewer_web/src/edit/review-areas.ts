/** The areas of a review in the local frame, ready to be drawn. */
import type { Review } from '../api/documents.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { StageFloor } from '../load/stage.ts';
import { type Area, circle } from './area-overlay.ts';
import { coplanarRegion } from './coplanar-region.ts';
import { type Door, doorsOf } from './doors.ts';
import { localOf } from './draft.ts';
import type { Place } from './ground-map.ts';
import { triangleAt } from './triangle-at.ts';

/** So much below a floor's ground still belongs to it. */
const SLAB_M = 0.3;

/** Half the diagonal of an entrance's diamond. */
const ENTRANCE_M = 0.45;
/** Doors of a building, which many reviews are drawn on. */
const doorsOfStage = new WeakMap<object, readonly Door[]>();

/** An area of no floor is drawn on each. `tintsGround`: marked ground is filled, which no layer's colours survive. */
export function reviewAreas(review: Review, loaded: LoadedPlan, tintsGround: boolean): Area[] {
  const { floors, offsetM, triangles } = loaded.stage;
  const inPlan = ([x, y]: Place): Place => [x - offsetM[0], y - offsetM[1]];
  const onFloors = (floorId: string): { floorId: string; heightM: number }[] =>
    floors
      .filter(({ id }) => floorId === '' || id === floorId)
      .map(({ id, elevationM }) => ({ floorId: id, heightM: elevationM }));
  const zones = Object.values(review.zones).flatMap(({ kind, floor, outline_m }) =>
    onFloors(floor).map((on): Area => ({ kind, ...on, outline: outline_m.map(inPlan) })),
  );
  const forbidden = Object.values(review.forbidden).flatMap(({ position_m, radius_m, floor }) =>
    onFloors(floor).map(
      (on): Area => ({ kind: 'forbidden', ...on, outline: circle(inPlan([position_m[0], position_m[1]]), radius_m) }),
    ),
  );
  const picks = Object.values(review.ground_picks).flatMap(({ point_m, is_ground, floor }): Area[] => {
    const triangle = triangleAt(triangles.cornersM, localOf(point_m, offsetM));
    if (triangle === null) return [];
    const kind = is_ground ? 'ground' : 'not_ground';
    const floorId = floor || floorAt(floors, point_m[2] - offsetM[2]);
    const cornersM = regionCorners(triangles.cornersM, triangle);
    return [{ kind, floorId, heightM: 0, cornersM, isRimAlone: !tintsGround }];
  });
  return [...zones, ...forbidden, ...picks, ...entranceAreas(review, loaded)];
}

/** A diamond where one enters, and a circle round each door that is marked. */
function entranceAreas(review: Review, { stage }: LoadedPlan): Area[] {
  const entrances = Object.values(review.entrances).map(({ position_m, floor }): Area => {
    const [x, y, heightM] = localOf(position_m, stage.offsetM);
    const outline = [0, 1, 2, 3].map((k): Place => {
      const angle = (k * Math.PI) / 2;
      return [x + ENTRANCE_M * Math.cos(angle), y + ENTRANCE_M * Math.sin(angle)];
    });
    return { kind: 'entrance', floorId: floor, heightM, outline };
  });
  if (Object.keys(review.doors).length === 0) return entrances;
  const known = doorsOfStage.get(stage) ?? doorsOf(stage);
  doorsOfStage.set(stage, known);
  const doors = known.flatMap(({ element, lowM, highM }): Area[] => {
    const state = review.doors[element.sourceId];
    if (state === undefined) return [];
    const [x, y, heightM] = [(lowM[0] + highM[0]) / 2, (lowM[1] + highM[1]) / 2, lowM[2]];
    const radiusM = Math.hypot(highM[0] - lowM[0], highM[1] - lowM[1]) / 2;
    return [{ kind: `door_${state}`, floorId: element.floorId, heightM, outline: circle([x, y], radiusM) }];
  });
  return [...entrances, ...doors];
}

/** Id of the floor that a height (local) belongs to: the highest one below it, else the lowest. */
export function floorAt(floors: readonly StageFloor[], heightM: number): string {
  const below = floors.filter(({ elevationM }) => elevationM - SLAB_M <= heightM);
  return (below.at(-1) ?? floors[0])?.id ?? '';
}

/** Corners (T, 9) of the region that a click on a triangle means. */
export function regionCorners(cornersM: Float32Array, triangle: number): Float32Array {
  const region = coplanarRegion(cornersM, triangle);
  const corners = new Float32Array(9 * region.length);
  region.forEach((t, i) => {
    corners.set(cornersM.subarray(9 * t, 9 * t + 9), 9 * i);
  });
  return corners;
}
