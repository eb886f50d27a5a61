/** Rooms of the plan as it is shown, which one is chosen, and whether their names stand in the picture. */
import { type Signal, signal } from '@preact/signals';
import type { RoomFigures } from './rooms.ts';

export interface RoomState {
  /** In the order of layers.json; null: an older version made the plan, or they are not read yet. */
  readonly rooms: Signal<readonly RoomFigures[] | null>;
  /** Ids of the stations that stand in each room, by its number. */
  readonly stationsOfRooms: Signal<ReadonlyMap<number, readonly string[]>>;
  /** Why rooms can't be shown; empty: they can. */
  readonly roomTrouble: Signal<string>;
  /** Number of the chosen room. */
  readonly roomNumber: Signal<number | null>;
  readonly showsRoomNames: Signal<boolean>;
}

export const createRoomState = (): RoomState => ({
  rooms: signal<readonly RoomFigures[] | null>(null),
  stationsOfRooms: signal<ReadonlyMap<number, readonly string[]>>(new Map()),
  roomTrouble: signal(''),
  roomNumber: signal<number | null>(null),
  showsRoomNames: signal(true),
});
