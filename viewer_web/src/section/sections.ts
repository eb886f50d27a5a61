/** Beginning and ending sections: a box around what is shown, a line on the plan. */
import { batch } from '@preact/signals';
import { extentOf } from '../floors/cut.ts';
import type { Store } from '../store.ts';
import type { PlaceM } from './planes.ts';

/** The box begins as what is shown, and cuts the building in place of the floor's own cut. */
export function boxAroundShown(store: Store): void {
  const [extents, slices] = [store.extents.peek(), store.slices.peek()];
  if (extents === null) return;
  const isSpread = slices.length > 1;
  const { minM, maxM } = isSpread ? extents.whole : extentOf(slices, extents.whole, extents.grounds);
  batch(() => {
    showWhole(store);
    store.sectionBox.value = { minM, maxM };
  });
}

/** Cut along a line in plan, local frame, and look at it squarely. */
export function cutAlong(store: Store, fromM: PlaceM, toM: PlaceM): void {
  batch(() => {
    showWhole(store);
    store.sectionLine.value = { fromM, toM, isFlipped: false };
    store.isPlanView.value = false;
    store.isFacing.value = true;
  });
}

/** The building as it was shown before. */
export function endSection(store: Store): void {
  batch(() => {
    const before = store.shownBefore.peek();
    store.sectionBox.value = null;
    store.sectionLine.value = null;
    store.isFacing.value = false;
    store.shownBefore.value = null;
    if (before === null) return;
    store.floorId.value = before.floorId;
    store.isSpread.value = before.isSpread;
  });
}

function showWhole(store: Store): void {
  store.shownBefore.value ??= { floorId: store.floorId.peek(), isSpread: store.isSpread.peek() };
  store.floorId.value = null;
  store.isSpread.value = false;
  store.hidesCeilings.value = false;
}
