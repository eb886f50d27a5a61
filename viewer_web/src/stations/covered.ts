/** Stations in the picture that other floors hide, as lower floors are from above: their numbers would seem to stand there. */
import type { MarkerPlace } from '../scene/plan-view.ts';
import type { ShownStation } from './shown.ts';

export interface CoveredStations {
  /** The chosen station, where something hides it that opening its floor takes away; by: the floor that does, null: its own building. */
  readonly chosen: { readonly id: string; readonly by: string | null } | null;
  /** How many other stations are hidden by other floors, by the floor they stand on. */
  readonly nByFloor: ReadonlyMap<string, number>;
}

export const NONE_COVERED: CoveredStations = { chosen: null, nByFloor: new Map() };

interface Picture {
  readonly width: number;
  readonly height: number;
  /** Floors are neither opened nor lifted apart: walls and roofs hide all that stands inside. */
  readonly isWhole: boolean;
}

export function coveredAmong(
  places: ReadonlyMap<string, MarkerPlace>,
  stations: readonly ShownStation[],
  chosenId: string | null,
  { width, height, isWhole }: Picture,
): CoveredStations {
  const nByFloor = new Map<string, number>();
  let chosen: CoveredStations['chosen'] = null;
  for (const { id, floorId } of stations) {
    const place = places.get(id);
    if (place === undefined || place.x < 0 || place.y < 0 || place.x > width || place.y > height) continue;
    if (id === chosenId) {
      if (place.coveredBy !== null || (isWhole && place.isHidden)) chosen = { id, by: place.coveredBy };
    } else if (place.coveredBy !== null) nByFloor.set(floorId, (nByFloor.get(floorId) ?? 0) + 1);
  }
  return { chosen, nByFloor };
}

export function isSameCovered(a: CoveredStations, b: CoveredStations): boolean {
  const isSameChosen = a.chosen?.id === b.chosen?.id && a.chosen?.by === b.chosen?.by;
  return (
    isSameChosen && a.nByFloor.size === b.nByFloor.size && [...a.nByFloor].every(([id, n]) => b.nByFloor.get(id) === n)
  );
}
