/** Two plans, patch by patch: what one sees and the other does not. */

import { type ClassLayer, NOT_ACHIEVABLE, NOT_ASKED, NOT_ASKED_CLASS } from '../heat/layers.ts';
import { t } from '../language/language.ts';

export const DIFFERENCE = { none: 0, both: 1, lost: 2, gained: 3 } as const;

export const DIFFERENCE_ID = 'difference';

/**
 * The layer against a plan of this title; what is gained against the plan as it was made is only here of two others.
 * `isOfSomeFloors`: one of them is not of all that the other is of.
 */
export function differenceLayer(other: string, isAsMade: boolean, isOfSomeFloors: boolean): ClassLayer {
  const notCompared = { ...NOT_ASKED_CLASS, label: t('not to be covered, or in one plan only') };
  return {
    kind: 'classes',
    id: DIFFERENCE_ID,
    title: isAsMade ? t('Difference from the original plan') : t('Difference from {other}', { other }),
    classes: [
      { value: DIFFERENCE.gained, label: isAsMade ? t('gained') : t('seen only in this plan'), color: '#2b8a9b' },
      { value: DIFFERENCE.lost, label: isAsMade ? t('lost') : t('seen only in {other}', { other }), color: '#c2453a' },
      { value: DIFFERENCE.both, label: t('seen in both'), color: { light: '#d4e7e3', dark: '#8c979c' } },
      { value: DIFFERENCE.none, label: t('seen in neither'), color: '#e8b23a' },
      ...(isOfSomeFloors ? [notCompared] : []),
      { value: NOT_ACHIEVABLE, label: t('not scannable'), color: { light: '#c6cacc', dark: '#6d757a' } },
    ],
  };
}

/** One class a patch: what `shown` gained and lost against `other`; both as `times_seen`, `NOT_ASKED` where either was not asked. */
export function differenceOf(shown: Uint8Array, other: Uint8Array): Uint8Array {
  if (shown.length !== other.length) {
    throw new RangeError(
      t('{shown} patches against {other}: the plans are of different surfaces', {
        shown: shown.length,
        other: other.length,
      }),
    );
  }
  const sees = (byte: number): boolean => byte !== 0 && byte !== NOT_ACHIEVABLE;
  return shown.map((byte, i) => {
    if (byte === NOT_ASKED || other[i] === NOT_ASKED) return NOT_ASKED;
    if (sees(byte)) return sees(other[i]) ? DIFFERENCE.both : DIFFERENCE.gained;
    if (sees(other[i])) return DIFFERENCE.lost;
    return byte === NOT_ACHIEVABLE && other[i] === NOT_ACHIEVABLE ? NOT_ACHIEVABLE : DIFFERENCE.none;
  });
}

/** A station that stands elsewhere in the other plan, or is in one of them only. */
export type StationChange =
  | { readonly kind: 'moved'; readonly fromM: PointM; readonly toM: PointM; readonly floorId: string }
  | { readonly kind: 'new' | 'gone'; readonly atM: PointM; readonly floorId: string };
type PointM = readonly [number, number, number];

export interface PlacedStation {
  readonly positionM: PointM;
  readonly floorId: string;
}

/** Further away a station is another one, not the same one moved. */
const FARTHEST_MOVE_M = 4;
const SAME_PLACE_M = 0.01;

/**
 * Pair the stations of two plans, nearest pair first, floor by floor; what finds no partner is new or gone.
 *
 * Not by id: numbers follow the route, so another plan numbers anew.
 */
export function stationChanges(shown: readonly PlacedStation[], other: readonly PlacedStation[]): StationChange[] {
  const pairs: { to: number; from: number; distanceM: number }[] = [];
  shown.forEach((a, to) => {
    other.forEach((b, from) => {
      const distanceM = Math.hypot(...a.positionM.map((value, i) => value - b.positionM[i]));
      if (a.floorId === b.floorId && distanceM <= FARTHEST_MOVE_M) pairs.push({ to, from, distanceM });
    });
  });
  pairs.sort((a, b) => a.distanceM - b.distanceM || a.to - b.to || a.from - b.from);
  const [paired, left] = [new Set<number>(), new Set(other.keys())];
  const changes: StationChange[] = [];
  for (const { to, from, distanceM } of pairs) {
    if (paired.has(to) || !left.has(from)) continue;
    paired.add(to);
    left.delete(from);
    if (distanceM <= SAME_PLACE_M) continue;
    const floorId = shown[to].floorId;
    changes.push({ kind: 'moved', fromM: other[from].positionM, toM: shown[to].positionM, floorId });
  }
  shown.forEach(({ positionM, floorId }, i) => {
    if (!paired.has(i)) changes.push({ kind: 'new', atM: positionM, floorId });
  });
  for (const i of left) changes.push({ kind: 'gone', atM: other[i].positionM, floorId: other[i].floorId });
  return changes;
}
