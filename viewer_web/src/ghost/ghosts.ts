/** Finds stations to propose: the one that joins most groups, and the one that sees most of an unseen surface. */
import type { ApiClient } from '../api/client.ts';
import type { Point } from '../api/documents.ts';
import { sceneOf, usualHeightM } from '../edit/draft.ts';
import { fetchGround } from '../edit/ground-map.ts';
import { askPreview } from '../edit/previews.ts';
import { isLive } from '../edit/readiness.ts';
import { stationsOf } from '../edit/review-stations.ts';
import { isPlanned } from '../floors/planned.ts';
import { TIMES_SEEN } from '../heat/layers.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { countingOf, networkOf } from '../network/graph.ts';
import type { Store } from '../store.ts';
import { type JoinPlace, joinPlaces } from './join-places.ts';
import type { Ghost } from './state.ts';

/** Its answers are not questions of a drag: none overtakes another. */
const NO_SEQUENCE = 0;

/** Take the proposal away, and end a search for one. */
export function dropGhost(store: Store): void {
  store.ghostWork.peek()?.abort();
  store.ghost.value = null;
  store.joinSearch.value = { kind: 'none' };
}

/** Try tripod positions between groups, and propose the one that leaves the fewest; of equals the one that covers most. */
export async function searchJoin(store: Store, loaded: LoadedPlan): Promise<void> {
  const client = store.reviewClient?.client;
  if (client === undefined) return;
  const signal = begin(store);
  try {
    // Answers are of the edited plan.
    store.editing.showsPlan.value = false;
    const { components } = networkOf(
      store.shownStations.value.map(({ id }) => id),
      store.shownLinks.value,
      countingOf(loaded.plan),
    );
    store.joinSearch.value = { kind: 'searching', nTried: 0, of: 0 };
    const places = await placesBetween(store, loaded, client, components);
    let best: Ghost | null = null;
    for (const [nTried, place] of places.entries()) {
      if (signal.aborted) return;
      store.joinSearch.value = { kind: 'searching', nTried, of: places.length };
      const found = await ghostAt(client, 'join', place, signal);
      if (found.head?.admissible && isBetter(found, best)) best = found;
      if (signal.aborted) return;
    }
    const isJoining = best?.head != null && best.head.registration.n_networks < components.length;
    store.joinSearch.value = isJoining ? { kind: 'none' } : { kind: 'nothing', nTried: places.length };
    if (isJoining) propose(store, best);
  } catch (error) {
    if (!signal.aborted) store.joinSearch.value = { kind: 'failed', message: (error as Error).message };
  }
}

/** Propose the position that the plan names for an unseen surface; what it is worth follows, where something computes it. */
export async function proposeFor(store: Store, loaded: LoadedPlan, positionM: Point, floorId: string): Promise<void> {
  const signal = begin(store);
  const heightM = usualHeightM(stationsOf(store), floorId, loaded.plan.settings.instrument_heights_m);
  const place = { floorId, positionM, heightM };
  propose(store, { ...place, purpose: 'unseen', head: null });
  const client = store.reviewClient?.client;
  if (client === undefined || !isLive(store)) return;
  try {
    const found = await ghostAt(client, 'unseen', place, signal);
    if (!signal.aborted) store.ghost.value = found;
  } catch (error) {
    if (!signal.aborted) store.reviewClient?.warn((error as Error).message);
  }
}

function begin(store: Store): AbortSignal {
  dropGhost(store);
  const work = new AbortController();
  store.ghostWork.value = work;
  return work.signal;
}

function propose(store: Store, ghost: Ghost | null): void {
  store.ghost.value = ghost;
  if (ghost !== null) store.floorId.value = ghost.floorId;
}

function isBetter({ head: a }: Ghost, best: Ghost | null): boolean {
  const b = best?.head ?? null;
  if (a === null || b === null) return b === null;
  const fewer = b.registration.n_networks - a.registration.n_networks;
  return fewer > 0 || (fewer === 0 && a.coverage.covered_area_m2 > b.coverage.covered_area_m2);
}

async function ghostAt(
  client: ApiClient,
  purpose: Ghost['purpose'],
  place: JoinPlace,
  signal: AbortSignal,
): Promise<Ghost> {
  const wish = { stationId: null, ...place, layerId: TIMES_SEEN };
  const { head } = await askPreview(client, wish, NO_SEQUENCE, signal);
  const [x, y, z] = head.position;
  return { ...place, purpose, positionM: [x, y, z], heightM: head.instrument_height_m, head };
}

async function placesBetween(
  store: Store,
  loaded: LoadedPlan,
  client: ApiClient,
  components: readonly (readonly string[])[],
): Promise<readonly JoinPlace[]> {
  const { plan, stage } = loaded;
  const shown = new Map(store.shownStations.value.map((station) => [station.id, station]));
  const groups = components.map((ids) =>
    ids.flatMap((id) => {
      const station = shown.get(id);
      return station === undefined ? [] : [{ id, positionM: sceneOf(station.positionM, stage.offsetM) }];
    }),
  );
  const floors = plan.floors.filter((floor) => isPlanned(floor, plan.requirements.floors));
  const grounds = await Promise.all(
    floors.map(async ({ id, elevation_m: elevationM }) => ({
      ground: await fetchGround(client, id),
      elevationM,
      heightM: usualHeightM(stationsOf(store), id, plan.settings.instrument_heights_m),
    })),
  );
  return joinPlaces(groups, grounds);
}
