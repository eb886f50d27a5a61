/** What a station on its way changes: surface that is covered then and was not, or no longer is, and links won and lost. */
import { NOT_ACHIEVABLE, OUT_OF_SCOPE, type PatchValues } from '../heat/layers.ts';
import { type Counting, counts, type LinkFigures } from '../network/graph.ts';

export interface SurfaceChange {
  /** Patches. */
  readonly won: readonly number[];
  readonly lost: readonly number[];
  readonly wonM2: number;
  readonly lostM2: number;
}

export interface PatchesBefore {
  /** Stations that see each patch without the change. */
  readonly timesSeen: PatchValues;
  readonly areasM2: ArrayLike<number>;
  /** Reason of each patch, where some need not be covered. */
  readonly scope: Uint8Array | null;
  /** Stations that have to see a patch. */
  readonly seenFrom: number;
}

/** `patches` see `timesSeen` instead. */
export function surfaceChange(
  { patches, timesSeen }: { readonly patches: ArrayLike<number>; readonly timesSeen: ArrayLike<number> },
  before: PatchesBefore,
): SurfaceChange {
  const [won, lost]: [number[], number[]] = [[], []];
  let [wonM2, lostM2] = [0, 0];
  for (let i = 0; i < patches.length; i++) {
    const patch = patches[i];
    const was = before.timesSeen[patch];
    if (was === NOT_ACHIEVABLE || before.scope?.[patch] === OUT_OF_SCOPE) continue;
    const [isCovered, wasCovered] = [timesSeen[i] >= before.seenFrom, was >= before.seenFrom];
    if (isCovered && !wasCovered) {
      won.push(patch);
      wonM2 += before.areasM2[patch];
    } else if (wasCovered && !isCovered) {
      lost.push(patch);
      lostM2 += before.areasM2[patch];
    }
  }
  return { won, lost, wonM2, lostM2 };
}

interface Ends extends LinkFigures {
  readonly a: string;
  readonly b: string;
}

export interface LinkChange {
  /** Stations that it registers with, before and after. */
  readonly kept: readonly string[];
  readonly won: readonly string[];
  readonly lost: readonly string[];
}

/** Of one station; `stationId` null: a new one, which has no links before. */
export function linkChange(
  stationId: string | null,
  before: readonly Ends[],
  after: readonly Ends[],
  counting: Counting,
): LinkChange {
  const others = (links: readonly Ends[], id: string): string[] =>
    links
      .filter((link) => (link.a === id || link.b === id) && counts(link, counting))
      .map(({ a, b }) => (a === id ? b : a));
  const was = stationId === null ? [] : others(before, stationId);
  // A new one has no id yet.
  const now = others(after, stationId ?? '');
  return {
    kept: now.filter((id) => was.includes(id)),
    won: now.filter((id) => !was.includes(id)),
    lost: was.filter((id) => !now.includes(id)),
  };
}
