/** Stations as the 3D side and the lists show them: the plan's, or those of a draft. */
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanStation, StationLoss } from '../load/plan-json.ts';
import { stationNumbers } from './station-numbers.ts';

/** What a draft changed about a station. */
export type StationMark = 'moved' | 'added' | 'removed' | 'locked';

/** What a station sees by itself, and what would be lost without it, as plan.json has it. */
export interface StationWorth extends Readonly<Pick<PlanStation, 'covered_area_m2' | 'own_area_m2' | 'lost_area_m2'>> {
  readonly losses: readonly StationLoss[] | null;
}

export interface ShownStation {
  readonly id: string;
  readonly floorId: string;
  /** As it is marked. */
  readonly number: number;
  /** Place in the walk, from 1. */
  readonly order: number;
  /** The sensor's origin, local frame, metres. */
  readonly positionM: readonly [number, number, number];
  readonly marks: readonly StationMark[];
  /** What it is worth, where that is not what the plan says. */
  readonly worth?: StationWorth;
}

export function shownStationsOf(loaded: LoadedPlan | null): readonly ShownStation[] {
  if (loaded === null) return [];
  const numbers = stationNumbers(loaded.stage.stations.map(({ id }) => id));
  return loaded.stage.stations.map(({ id, floorId, order, positionM }) => ({
    id,
    floorId,
    number: numbers.get(id)!,
    order,
    positionM,
    marks: [],
  }));
}
