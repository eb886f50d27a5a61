/** The unseen surfaces of a plan as the list shows them: of a floor, of some reasons, largest first. */
import type { UnseenSurface } from '../load/plan-json.ts';

/** Reasons of surface that some admissible spot sees as asked: a further station would cover it. */
const MENDABLE = new Set(['not worth a station', 'too few spots see it']);

export interface UnseenFilter {
  /** Null: all floors. */
  readonly floorId: string | null;
  /** Null: all reasons. */
  readonly reason: string | null;
}

export function surfacesShown(surfaces: readonly UnseenSurface[], { floorId, reason }: UnseenFilter): UnseenSurface[] {
  return surfaces
    .filter((surface) => floorId === null || surface.floor === floorId)
    .filter((surface) => reason === null || surface.reason === reason)
    .sort((a, b) => b.area_m2 - a.area_m2);
}

export interface ReasonSum {
  readonly reason: string;
  readonly areaM2: number;
  readonly isMendable: boolean;
}

/** Area by reason, what a station would mend first, then by size. */
export function sumsByReason(surfaces: readonly UnseenSurface[]): ReasonSum[] {
  const sums = new Map<string, number>();
  for (const { reason, area_m2 } of surfaces) sums.set(reason, (sums.get(reason) ?? 0) + area_m2);
  return [...sums]
    .map(([reason, areaM2]) => ({ reason, areaM2, isMendable: MENDABLE.has(reason) }))
    .sort((a, b) => Number(b.isMendable) - Number(a.isMendable) || b.areaM2 - a.areaM2);
}
