/** Which floor is shown, and where the building is cut. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { LoadState } from '../load/state.ts';
import type { WalkState } from '../walk/state.ts';
import { DEFAULT_CUT_M, type Slice, slicesOf, WHOLE_BUILDING } from './cut.ts';

export interface FloorState {
  /** Null: all floors. */
  readonly floorId: Signal<string | null>;
  readonly isSpread: Signal<boolean>;
  readonly cutM: Signal<number>;
  readonly hidesCeilings: Signal<boolean>;
  readonly slices: ReadonlySignal<readonly Slice[]>;
}

export function createFloorState({ loaded, extents }: LoadState, { isWalking }: WalkState): FloorState {
  const floorId = signal<string | null>(null);
  const isSpread = signal(true);
  const cutM = signal(DEFAULT_CUT_M);
  const hidesCeilings = signal(false);
  const slices = computed<readonly Slice[]>(() => {
    const [plan, boxes] = [loaded.value, extents.value];
    if (plan === null || boxes === null) return [];
    if (isWalking.value) return [WHOLE_BUILDING];
    const view = {
      floorId: floorId.value,
      isSpread: isSpread.value,
      cutM: cutM.value,
      hidesCeilings: hidesCeilings.value,
    };
    return slicesOf(view, plan.stage.floors, boxes.whole);
  });
  return { floorId, isSpread, cutM, hidesCeilings, slices };
}
