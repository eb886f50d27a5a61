/** The stations in which the shown plan differs from the one it is compared with, on the floors that both are of. */
import { localOf } from '../edit/draft.ts';
import type { Store } from '../store.ts';
import { type StationChange, stationChanges } from './difference.ts';
import { commonFloors } from './floors-compared.ts';

/** None where nothing is compared; local frame, not lifted. */
export function changesShown(store: Store): StationChange[] {
  const [comparison, loaded] = [store.comparison.value, store.loaded.value];
  if (comparison.kind !== 'shown' || loaded === null) return [];
  const { plan } = comparison.other;
  const both = commonFloors(loaded.plan, plan);
  const others = plan.stations.map(({ position, floor }) => ({
    positionM: localOf(position, loaded.stage.offsetM),
    floorId: floor,
  }));
  const isCompared = ({ floorId }: { readonly floorId: string }): boolean => both.has(floorId);
  return stationChanges(store.shownStations.value.filter(isCompared), others.filter(isCompared));
}
