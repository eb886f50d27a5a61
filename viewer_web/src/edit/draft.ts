/** The draft: the plan's stations as the review has them. Scene frame, metres. */

import type { Point, Review } from '../api/documents.ts';
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import type { ShownStation, StationMark } from '../stations/shown.ts';
import { stationNumbers } from '../stations/station-numbers.ts';

export interface DraftStation {
  readonly id: string;
  readonly floorId: string;
  /** As it is marked. */
  readonly number: number;
  /** Place in the walk, from 1; 0: removed. */
  readonly order: number;
  readonly positionM: Point;
  /** Null: the plan does not know it. */
  readonly instrumentHeightM: number | null;
  /** Its scan exists: nobody moves it. */
  readonly isFixed: boolean;
  readonly isLocked: boolean;
  readonly isRemoved: boolean;
  readonly isAdded: boolean;
  /** Where the plan has it, where that is somewhere else. */
  readonly movedFromM: Point | null;
}

/** A review says positions to so many metres; nearer is the same place. */
const SAME_PLACE_M = 1e-6;

/** Stations in the order of visits; removed ones are among them. */
export function draftStations(plan: PlanJson, review: Review | null): DraftStation[] {
  const edits = review?.stations ?? {};
  const inOrder = [...plan.stations].sort((a, b) => a.order - b.order);
  const found = inOrder.map((station): Unnumbered => {
    const edit = edits[station.id];
    const positionM = edit?.position_m ?? station.position;
    const isMoved = positionM.some((value, i) => Math.abs(value - station.position[i]) > SAME_PLACE_M);
    return {
      id: station.id,
      floorId: edit?.floor ?? station.floor,
      positionM,
      instrumentHeightM: edit?.instrument_height_m ?? station.instrument_height_m,
      isFixed: station.fixed,
      isLocked: edit?.locked ?? settledAs(plan, 'locked').has(station.id),
      isRemoved: edit?.removed ?? false,
      isAdded: false,
      movedFromM: isMoved ? station.position : null,
    };
  });
  const added = Object.entries(edits)
    .filter(([, edit]) => edit.added && edit.position_m !== null)
    .sort(([a], [b]) => (a < b ? -1 : 1))
    .map(
      ([id, edit]): Unnumbered => ({
        id,
        floorId: edit.floor ?? '',
        positionM: edit.position_m as Point,
        instrumentHeightM: edit.instrument_height_m,
        isFixed: false,
        isLocked: edit.locked ?? false,
        isRemoved: false,
        isAdded: true,
        movedFromM: null,
      }),
    );
  for (const one of added) found.splice(placeInVisits(found, one), 0, one);
  return numbered(found);
}

type Unnumbered = Omit<DraftStation, 'number' | 'order'>;

/**
 * Behind the station of its floor that is nearest in plan, the first of equals; last where its floor has none. Exports have the
 * same rule: `planner_core/review/stations.py`.
 */
function placeInVisits(stations: readonly Unnumbered[], added: Unnumbered): number {
  let [least, place] = [Number.POSITIVE_INFINITY, stations.length];
  for (const [i, { floorId, positionM, isRemoved }] of stations.entries()) {
    const [dx, dy] = [positionM[0] - added.positionM[0], positionM[1] - added.positionM[1]];
    const away = dx * dx + dy * dy;
    if (!isRemoved && floorId === added.floorId && away < least) [least, place] = [away, i + 1];
  }
  return place;
}

function numbered(stations: readonly Unnumbered[]): DraftStation[] {
  const numbers = stationNumbers(stations.filter(({ isRemoved }) => !isRemoved).map(({ id }) => id));
  let order = 0;
  return stations.map((station) => {
    if (!station.isRemoved) order += 1;
    return { ...station, number: numbers.get(station.id) ?? 0, order: station.isRemoved ? 0 : order };
  });
}

function settledAs(plan: PlanJson, role: string): Set<string> {
  const settled = (plan as { site?: { settled?: readonly { id: string; role: string }[] } }).site?.settled ?? [];
  return new Set(settled.filter((station) => station.role === role).map(({ id }) => id));
}

/** How many stations a review changes, by what it does to them. */
export interface EditCounts {
  readonly moved: number;
  readonly added: number;
  readonly removed: number;
}

export function countEdits(stations: readonly DraftStation[]): EditCounts {
  return {
    moved: stations.filter((station) => station.movedFromM !== null && !station.isRemoved).length,
    added: stations.filter((station) => station.isAdded).length,
    removed: stations.filter((station) => station.isRemoved).length,
  };
}

/** "2 moved, 1 added"; empty where nothing is changed. */
export function editsInWords({ moved, added, removed }: EditCounts): string {
  return [
    moved > 0 && t('{n} moved', { n: moved }),
    added > 0 && t('{n} added', { n: added }),
    removed > 0 && t('{n} removed', { n: removed }),
  ]
    .filter(Boolean)
    .join(', ');
}

/** As the 3D side draws them: without the removed ones, in the local frame. */
export function shownInDraft(
  stations: readonly DraftStation[],
  offsetM: readonly [number, number, number],
): ShownStation[] {
  return stations
    .filter((station) => !station.isRemoved)
    .map((station) => ({
      id: station.id,
      floorId: station.floorId,
      number: station.number,
      order: station.order,
      positionM: localOf(station.positionM, offsetM),
      marks: marksOf(station),
    }));
}

function marksOf(station: DraftStation): StationMark[] {
  const marks: StationMark[] = [];
  if (station.movedFromM !== null) marks.push('moved');
  if (station.isAdded) marks.push('added');
  if (station.isLocked) marks.push('locked');
  return marks;
}

/** Where the plan tells none. */
const TRIPOD_HEIGHT_M = 1.6;

/**
 * The height that a new station of a floor gets: the middle of those of its stations, else of all, else of the heights that
 * the plan tried. The first one's may be the one of a niche.
 */
export function usualHeightM(stations: readonly DraftStation[], floorId: string, tried: readonly number[]): number {
  const known = stations.filter(({ instrumentHeightM, isRemoved }) => instrumentHeightM !== null && !isRemoved);
  const ofFloor = known.filter((station) => station.floorId === floorId);
  const heights = (ofFloor.length > 0 ? ofFloor : known).map(({ instrumentHeightM }) => instrumentHeightM as number);
  const sorted = (heights.length > 0 ? heights : [...tried]).sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? TRIPOD_HEIGHT_M;
}

export const localOf = (sceneM: Point, offsetM: readonly [number, number, number]): [number, number, number] => [
  sceneM[0] - offsetM[0],
  sceneM[1] - offsetM[1],
  sceneM[2] - offsetM[2],
];
export const sceneOf = (localM: Point, offsetM: readonly [number, number, number]): [number, number, number] => [
  localM[0] + offsetM[0],
  localM[1] + offsetM[1],
  localM[2] + offsetM[2],
];
