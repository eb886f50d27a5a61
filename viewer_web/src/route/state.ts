/** The crew's route: whether it is drawn, and whose it is. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { PlanJson, PlanRoute } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';

/** How the stations are walked to, and how long that takes. */
export type RouteAndTime = Pick<PlanJson, 'route' | 'field_time'>;

export interface RouteState {
  readonly showRoute: Signal<boolean>;
  /** The route of a draft and the time that it takes; null: those of the plan are shown. */
  readonly draftRoute: Signal<RouteAndTime | null>;
  readonly shownRoute: ReadonlySignal<PlanRoute | null>;
  readonly shownTime: ReadonlySignal<PlanJson['field_time']>;
}

export function createRouteState({ loaded }: LoadState): RouteState {
  const draftRoute = signal<RouteAndTime | null>(null);
  const shown = computed(() => draftRoute.value ?? loaded.value?.plan ?? null);
  return {
    showRoute: signal(false),
    draftRoute,
    shownRoute: computed(() => shown.value?.route ?? null),
    shownTime: computed(() => shown.value?.field_time ?? null),
  };
}
