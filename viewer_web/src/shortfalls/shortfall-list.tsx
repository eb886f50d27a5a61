/** The shortfalls beside the headline: a click shows each in the building. */

import { batch } from '@preact/signals';
import { useEffect, useState } from 'preact/hooks';
import { localOf } from '../edit/draft.ts';
import { floorAt } from '../edit/review-areas.ts';
import type { Totals } from '../edit/totals.ts';
import { type Slice, sliceOfFloor } from '../floors/cut.ts';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { areaWords } from '../panels/figures.ts';
import { Pins } from '../review/pins.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { type SealedGround, SealedOverlay } from './sealed-overlay.ts';
import { type SealedPlace, type Shortfall, sealedPlaces, shortfallsOf } from './shortfalls.ts';
import './shortfalls.css';

const RED = [179, 38, 46] as const;

interface ShortfallsProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly totals: Totals;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function ShortfallList({ store, loaded, totals, view }: ShortfallsProps) {
  const [nShown, setShown] = useState(0);
  useSealedPins(store, loaded, view);
  const shortfalls = shortfallsOf(loaded.plan, totals);
  if (shortfalls.length === 0) return null;
  return (
    <ul class="shortfalls" aria-label={t('What falls short')}>
      {shortfalls.map((shortfall) => (
        <li key={shortfall.words}>
          <button
            type="button"
            title={hintOf(shortfall)}
            onClick={() => {
              show(shortfall, nShown, store, loaded, view);
              if (shortfall.kind === 'unreachable') setShown((nShown + 1) % shortfall.places.length);
            }}
          >
            <span aria-hidden="true">!</span> {shortfall.words}
          </button>
        </li>
      ))}
    </ul>
  );
}

function hintOf(shortfall: Shortfall): string {
  if (shortfall.kind === 'unreachable') return t('Show the next one in the building; red areas mark all of them');
  return shortfall.kind !== 'groups' ? t('Show what is unseen') : t('Show the network');
}

function show(shortfall: Shortfall, nth: number, store: Store, loaded: LoadedPlan, view: PlanView | null): void {
  if (shortfall.kind === 'groups') store.tab.value = 'network';
  else if (shortfall.kind === 'unreachable') approach(shortfall.places[nth], store, loaded, view);
  else {
    const asked = shortfall.kind === 'requirement' ? shortfall.name : null;
    const floor = loaded.plan.floors.find(({ id, name }) => id === asked || name === asked);
    batch(() => {
      if (floor !== undefined) store.chooseFloor(floor.id);
      store.tab.value = 'unseen';
    });
  }
}

function floorOf({ floorId, insideM }: SealedPlace, { stage }: LoadedPlan): string {
  return floorId === '' ? floorAt(stage.floors, insideM[2] - stage.offsetM[2]) : floorId;
}

function approach(place: SealedPlace, store: Store, loaded: LoadedPlan, view: PlanView | null): void {
  const floorId = floorOf(place, loaded);
  store.chooseFloor(floorId);
  view?.approach(localOf(place.insideM, loaded.stage.offsetM), floorId);
}

/** A red dot in each, its ground filled and named, while the list is shown. */
function useSealedPins(store: Store, loaded: LoadedPlan, view: PlanView | null): void {
  const { value: slices } = store.slices;
  useEffect(() => {
    const grounds = sealedGrounds(loaded, slices);
    if (view === null || grounds.length === 0) return undefined;
    const [pins, areas] = [new Pins(RED), new SealedOverlay()];
    pins.set(grounds.map(({ insideM }) => insideM));
    areas.set(grounds);
    const removals = [view.addOverlay(pins.points), view.addOverlay(areas.group)];
    return () => {
      for (const remove of removals) remove();
      pins.dispose();
      areas.dispose();
    };
  }, [loaded, view, slices]);
}

/** Those of the floors that are shown. */
export function sealedGrounds(loaded: LoadedPlan, slices: readonly Slice[]): readonly SealedGround[] {
  return sealedPlaces(loaded.plan).flatMap((place) => groundOf(place, loaded, slices) ?? []);
}

/** An area as it is drawn; null: its floor is not shown. */
function groundOf(place: SealedPlace, loaded: LoadedPlan, slices: readonly Slice[]): SealedGround | null {
  const { offsetM } = loaded.stage;
  const slice = sliceOfFloor(slices, floorOf(place, loaded));
  if (slice === undefined) return null;
  const [x, y, z] = localOf(place.insideM, offsetM);
  const local = ([px, py]: readonly [number, number]) => [px - offsetM[0], py - offsetM[1]] as const;
  return {
    insideM: [x, y, z + slice.liftM],
    rectangles: place.rectangles.map(([low, high]) => [local(low), local(high)]),
    words: t('Not reachable · {area}', { area: areaWords(place.areaM2) }),
  };
}
