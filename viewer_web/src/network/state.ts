/** Which links are shown, and which pair of stations is chosen. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { PlanLink } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';
import type { StationState } from '../stations/state.ts';
import { countingOf, networkOf } from './graph.ts';
import { groupsOf, numberByStation } from './groups.ts';

/** Two stations, as a link names them. */
export type Pair = readonly [string, string];

export interface NetworkState {
  /** Of the draft, else of the plan. */
  readonly shownLinks: ReadonlySignal<readonly PlanLink[]>;
  readonly showLinks: Signal<boolean>;
  readonly pair: Signal<Pair | null>;
  /** Number of the group that each station is in; empty: all are connected. */
  readonly groupOf: ReadonlySignal<ReadonlyMap<string, number>>;
}

export function createNetworkState({ loaded }: LoadState, { draft, shownStations }: StationState): NetworkState {
  const shownLinks = computed(() => draft.value?.links ?? loaded.value?.plan.registration.links ?? []);
  return {
    shownLinks,
    groupOf: computed(() => {
      if (loaded.value === null) return new Map();
      const ids = shownStations.value.map(({ id }) => id);
      const report = networkOf(ids, shownLinks.value, countingOf(loaded.value.plan));
      return report.components.length < 2 ? new Map() : numberByStation(groupsOf(report));
    }),
    showLinks: signal(false),
    pair: signal<Pair | null>(null),
  };
}
