/** Which unseen surface is looked at. */
import { type Signal, signal } from '@preact/signals';
import type { UnseenSurface } from '../load/plan-json.ts';

/** One piece of an unseen surface that is looked at. */
export interface UnseenFocus {
  readonly surface: UnseenSurface;
  readonly piece: number;
}

export interface UnseenState {
  readonly unseenFocus: Signal<UnseenFocus | null>;
}

export const createUnseenState = (): UnseenState => ({ unseenFocus: signal<UnseenFocus | null>(null) });
