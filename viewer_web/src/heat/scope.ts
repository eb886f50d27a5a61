/** Which patches are to be covered. The others (out of scope, furniture, other floors) are neither seen nor unseen. */
import { NOT_ASKED, OUT_OF_SCOPE } from './layers.ts';

/** Values of `times_seen` are numbers of stations up to this one. */
const MOST_STATIONS = NOT_ASKED - 1;

/** How many stations see each patch, and `NOT_ASKED` where it need not be; `reasons` null: all is to be covered. */
export function withinScope(timesSeen: Uint8Array, reasons: ArrayLike<number> | null): Uint8Array {
  if (reasons === null) return timesSeen;
  return timesSeen.map((value, patch) => scoped(value, reasons[patch]));
}

/** The same for single patches. */
export function withinScopeAt(
  patches: ArrayLike<number>,
  timesSeen: ArrayLike<number>,
  reasons: ArrayLike<number> | null,
): ArrayLike<number> {
  return reasons === null ? timesSeen : Uint8Array.from(timesSeen, (value, i) => scoped(value, reasons[patches[i]]));
}

function scoped(value: number, reason: number): number {
  if (reason === OUT_OF_SCOPE) return NOT_ASKED;
  return value === NOT_ASKED ? MOST_STATIONS : value;
}
