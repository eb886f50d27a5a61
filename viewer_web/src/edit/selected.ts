/** Which of the draft's stations are selected together. */
import type { Store } from '../store.ts';
import type { DraftStation } from './draft.ts';
import { stationsOf } from './review-stations.ts';

export function selectedStations(store: Store): readonly DraftStation[] {
  const ids = store.selection.value;
  return stationsOf(store).filter(({ id, isRemoved }) => ids.has(id) && !isRemoved);
}
