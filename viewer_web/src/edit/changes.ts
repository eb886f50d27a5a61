/** The changes of a review that the panels make; docs/formats/review.md says what each means. */
import type { Change, Point, ZoneKind } from '../api/documents.ts';
import type { DoorState } from './entrance-words.ts';
import type { Place } from './ground-map.ts';

export interface Pose {
  readonly position_m: Point;
  readonly instrument_height_m: number | null;
  readonly floor: string;
}

export const moveStation = (station: string, pose: Pose): Change => ({ kind: 'move_station', station, ...pose });
/** Back where the plan has it. */
export const moveBack = (station: string): Change => ({ kind: 'move_station', station, position_m: null });
export const addStation = (pose: Pose): Change => ({ kind: 'add_station', ...pose });
export const removeStation = (station: string): Change => ({ kind: 'remove_station', station });
export const restoreStation = (station: string): Change => ({ kind: 'restore_station', station });
export const lockStation = (station: string, isLocked: boolean): Change => ({
  kind: isLocked ? 'lock_station' : 'unlock_station',
  station,
});

export function forbid(position_m: Point, radius_m: number, floor: string): Change {
  return { kind: 'forbid', place: { id: '', position_m, radius_m, floor } };
}
export const allow = (id: string): Change => ({ kind: 'allow', id });

interface NewZone {
  readonly kind: ZoneKind;
  readonly outline: readonly Place[];
  readonly floor: string;
  readonly name: string;
  /** Of priority zones: the share of them that is asked for. */
  readonly coverage: number | null;
}

export function addZone({ kind, outline, floor, name, coverage }: NewZone): Change {
  return { kind: 'add_zone', zone: { id: '', kind, outline_m: outline, floor, name, coverage } };
}
export const removeZone = (id: string): Change => ({ kind: 'remove_zone', id });

export function pickGround(point_m: Point, isGround: boolean, floor: string): Change {
  return { kind: 'pick_ground', pick: { point_m, is_ground: isGround, floor } };
}
export const unpickGround = (id: string): Change => ({ kind: 'unpick_ground', id });

export function addEntrance(position_m: Point, floor: string): Change {
  return { kind: 'add_entrance', entrance: { id: '', position_m, floor } };
}
export const removeEntrance = (id: string): Change => ({ kind: 'remove_entrance', id });
/** `door`: its GlobalId; null: as the plan has it. */
export const setDoor = (door: string, state: DoorState | null): Change => ({ kind: 'set_door', door, state });

/** A line of the list of changes. */
export interface Entry {
  readonly key: string;
  readonly title: string;
  readonly detail: string;
  /** Class of the swatch; null: none. */
  readonly swatch: string | null;
  readonly back: Change;
  readonly backLabel: string;
  readonly stationId?: string;
  readonly floorId?: string;
}
