/** One more station that is proposed and not added: where it would stand, and what it would be worth. */
import { type Signal, signal } from '@preact/signals';
import type { Point, PreviewHead } from '../api/documents.ts';

export interface Ghost {
  /** What it is for: joining groups, or an unseen surface. */
  readonly purpose: 'join' | 'unseen';
  readonly floorId: string;
  /** The sensor's origin, scene frame. */
  readonly positionM: Point;
  readonly heightM: number;
  /** Null: nothing computes it, or not yet. */
  readonly head: PreviewHead | null;
}

/** A search for a position that joins groups. */
export type JoinSearch =
  | { readonly kind: 'none' }
  | { readonly kind: 'searching'; readonly nTried: number; readonly of: number }
  /** No position that was tried joins any. */
  | { readonly kind: 'nothing'; readonly nTried: number }
  | { readonly kind: 'failed'; readonly message: string };

export interface GhostState {
  readonly ghost: Signal<Ghost | null>;
  readonly joinSearch: Signal<JoinSearch>;
  /** Ends what is asked for it. */
  readonly ghostWork: Signal<AbortController | null>;
}

export const createGhostState = (): GhostState => ({
  ghost: signal<Ghost | null>(null),
  joinSearch: signal<JoinSearch>({ kind: 'none' }),
  ghostWork: signal<AbortController | null>(null),
});
