/** The crew's route: whether it is drawn, and whose it is. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { PlanRoute } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';

export interface RouteState {
  readonly showRoute: Signal<boolean>;
  /** The route of a draft; null: the plan's. */
  readonly draftRoute: Signal<PlanRoute | null>;
  readonly shownRoute: ReadonlySignal<PlanRoute | null>;
}

export function createRouteState({ loaded }: LoadState): RouteState {
  const draftRoute = signal<PlanRoute | null>(null);
  return {
    showRoute: signal(false),
    draftRoute,
    shownRoute: computed(() => draftRoute.value ?? loaded.value?.plan.route ?? null),
  };
}
