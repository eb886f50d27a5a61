/** Another plan to hold the shown one against. */
import { type Signal, signal } from '@preact/signals';
import type { OtherPlan } from './comparison.ts';

export type Comparison =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading'; readonly base: string }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly other: OtherPlan };

export interface CompareState {
  /** Folder of the other plan; null: none is compared. */
  readonly compareBase: Signal<string | null>;
  /** What became of it. */
  readonly comparison: Signal<Comparison>;
}

export function createCompareState(): CompareState {
  return { compareBase: signal<string | null>(null), comparison: signal<Comparison>({ kind: 'none' }) };
}
