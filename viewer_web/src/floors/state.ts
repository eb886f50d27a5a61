/** Which floor is shown, and where the building is cut. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { LoadState } from '../load/state.ts';
import type { SectionState } from '../section/state.ts';
import type { WalkState } from '../walk/state.ts';
import { DEFAULT_CUT_M, type Slice, slicesOf, WHOLE_BUILDING } from './cut.ts';

export interface FloorState {
  /** Null: all floors. */
  readonly floorId: Signal<string | null>;
  readonly isSpread: Signal<boolean>;
  readonly cutM: Signal<number>;
  readonly hidesCeilings: Signal<boolean>;
  readonly slices: ReadonlySignal<readonly Slice[]>;
  /** The same without sections: which parts of the building are drawn at all. */
  readonly wholeSlices: ReadonlySignal<readonly Slice[]>;
}

export function createFloorState(
  { loaded, extents }: LoadState,
  { isWalking }: WalkState,
  { cutPlanes }: Pick<SectionState, 'cutPlanes'>,
): FloorState {
  const floorId = signal<string | null>(null);
  const isSpread = signal(true);
  const cutM = signal(DEFAULT_CUT_M);
  const hidesCeilings = signal(false);
  const wholeSlices = computed<readonly Slice[]>(() => {
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
  const slices = computed<readonly Slice[]>(() => {
    const planes = isWalking.value ? [] : cutPlanes.value;
    return planes.length === 0 ? wholeSlices.value : wholeSlices.value.map((slice) => ({ ...slice, planes }));
  });
  return { floorId, isSpread, cutM, hidesCeilings, slices, wholeSlices };
}
