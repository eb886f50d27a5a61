/** Walking at eye height, and the crew's route. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { PlanRoute } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';

export interface WalkState {
  readonly isWalking: Signal<boolean>;
  /** The address asks for a walk from where it puts the camera. */
  readonly startsWalking: Signal<boolean>;
  readonly showRoute: Signal<boolean>;
  /** The route of a draft; null: the plan's. */
  readonly draftRoute: Signal<PlanRoute | null>;
  readonly shownRoute: ReadonlySignal<PlanRoute | null>;
}

export function createWalkState({ loaded }: LoadState): WalkState {
  const draftRoute = signal<PlanRoute | null>(null);
  return {
    isWalking: signal(false),
    startsWalking: signal(false),
    showRoute: signal(false),
    draftRoute,
    shownRoute: computed(() => draftRoute.value ?? loaded.value?.plan.route ?? null),
  };
}
