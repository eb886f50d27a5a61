/** Stations as the 3D side and the lists show them: the plan's, or those of a draft. */
import type { LoadedPlan } from '../load/fetch-plan.ts';

/** What a draft changed about a station. */
export type StationMark = 'moved' | 'added' | 'removed' | 'locked';

export interface ShownStation {
  readonly id: string;
  readonly floorId: string;
  readonly order: number;
  /** The sensor's origin, local frame, metres. */
  readonly positionM: readonly [number, number, number];
  readonly marks: readonly StationMark[];
  /** Area it sees, and that no other sees, where that is not what the plan says. */
  readonly coveredAreaM2?: number;
  readonly ownAreaM2?: number;
}

export function shownStationsOf(loaded: LoadedPlan | null): readonly ShownStation[] {
  if (loaded === null) return [];
  return loaded.stage.stations.map(({ id, floorId, order, positionM }) => ({
    id,
    floorId,
    order,
    positionM,
    marks: [],
  }));
}
