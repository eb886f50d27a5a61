/** Who sees the surface that was clicked. */
import { type Signal, signal } from '@preact/signals';
import type { Sight } from './sights.ts';

export type SightsState =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading' }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly sights: readonly Sight[] };

export interface SightState {
  readonly sights: Signal<SightsState>;
}

export const createSightState = (): SightState => ({ sights: signal<SightsState>({ kind: 'none' }) });
