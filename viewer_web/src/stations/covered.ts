/** Stations in the picture that other floors hide, as lower floors are from above: their numbers would seem to stand there. */
import type { MarkerPlace } from '../scene/marker-place.ts';
import type { ShownStation } from './shown.ts';

export interface CoveredStations {
  /**
   * Of the chosen stations those that something hides which opening their floor takes away: another floor, or, where `by` is
   * null, walls and roof of the whole building.
   */
  readonly chosen: readonly { readonly id: string; readonly by: string | null }[];
  /** How many other stations are hidden by other floors, by the floor they stand on. */
  readonly nByFloor: ReadonlyMap<string, number>;
}

export const NONE_COVERED: CoveredStations = { chosen: [], nByFloor: new Map() };

interface Picture {
  readonly width: number;
  readonly height: number;
  /** Floors are neither opened nor lifted apart: walls and roofs hide all that stands inside. */
  readonly isWhole: boolean;
}

export function coveredAmong(
  places: ReadonlyMap<string, MarkerPlace>,
  stations: readonly ShownStation[],
  chosenIds: readonly string[],
  { width, height, isWhole }: Picture,
): CoveredStations {
  const nByFloor = new Map<string, number>();
  const chosen: { id: string; by: string | null }[] = [];
  for (const { id, floorId } of stations) {
    const place = places.get(id);
    if (place === undefined || place.x < 0 || place.y < 0 || place.x > width || place.y > height) continue;
    if (chosenIds.includes(id)) {
      if (place.coveredBy !== null || (isWhole && place.isHidden)) chosen.push({ id, by: place.coveredBy });
    } else if (place.coveredBy !== null) nByFloor.set(floorId, (nByFloor.get(floorId) ?? 0) + 1);
  }
  return { chosen, nByFloor };
}

export function isSameCovered(a: CoveredStations, b: CoveredStations): boolean {
  const words = ({ chosen, nByFloor }: CoveredStations): string => JSON.stringify([chosen, [...nByFloor]]);
  return words(a) === words(b);
}
