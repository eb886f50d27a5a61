/** The unseen surfaces of a plan as the list shows them: of a floor, of some reasons, largest first. */
import { totalsBeside } from '../edit/totals-beside.ts';
import { LEFT_BY_EDITS } from '../heat/layers.ts';
import type { UnseenSurface } from '../load/plan-json.ts';
import type { Store } from '../store.ts';

/** Of surface that enough admissible spots see as asked: the one reason that moving stations changes. */
const NOT_WORTH = 'not worth a station';
/** Reasons of surface that some admissible spot sees as asked: a further station would cover it. */
const MENDABLE = new Set([NOT_WORTH, LEFT_BY_EDITS, 'too few spots see it']);

/** What the list is of: the plan where nothing is edited, or edits are not shown; the edited plan; or the plan in its stead. */
export type UnseenOf = 'plan' | 'edited' | 'not edited';

export interface UnseenShown {
  readonly of: UnseenOf;
  /** Those of the last changes are being computed. */
  readonly isStale: boolean;
  readonly surfaces: readonly UnseenSurface[];
}

/** Null: an older version made the plan, which does not know. */
export function unseenShown(store: Store): UnseenShown | null {
  const why = store.loaded.value?.plan.why;
  const totals = totalsBeside(store);
  if (!why || totals === null) return null;
  const ofPlan = why.unseen_surfaces;
  if (!totals.isEdited || store.editing.showsPlan.value) return { of: 'plan', isStale: false, surfaces: ofPlan };
  const figures = store.reviewClient?.figures.value ?? null;
  if (totals.edited === null || figures === null) return { of: 'not edited', isStale: false, surfaces: ofPlan };
  const left = figures.unseen.map((surface) => ({ ...surface, reason: LEFT_BY_EDITS, best_spot: null }));
  // No station is behind the other reasons: they stay as they are wherever stations stand.
  const others = ofPlan.filter(({ reason }) => reason !== NOT_WORTH);
  return { of: 'edited', isStale: totals.isStale, surfaces: [...left, ...others] };
}

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
