/** Which links are shown, and which pair of stations is chosen. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { PlanLink } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';
import type { StationState } from '../stations/state.ts';

/** Two stations, as a link names them. */
export type Pair = readonly [string, string];

export interface NetworkState {
  /** Of the draft, else of the plan. */
  readonly shownLinks: ReadonlySignal<readonly PlanLink[]>;
  readonly showLinks: Signal<boolean>;
  readonly pair: Signal<Pair | null>;
}

export function createNetworkState({ loaded }: LoadState, { draft }: StationState): NetworkState {
  return {
    shownLinks: computed(() => draft.value?.links ?? loaded.value?.plan.registration.links ?? []),
    showLinks: signal(false),
    pair: signal<Pair | null>(null),
  };
}
