/** Keeps what is shown in step with the review: stations and links of the draft, and the values its stations give the patches. */

import { batch, computed, effect, type ReadonlySignal, signal, untracked } from '@preact/signals';
import type { DraftLink, DraftRoute, Run } from '../api/documents.ts';
import type { ReviewClient } from '../api/review-client.ts';
import type { PatchValues } from '../heat/layers.ts';
import { TIMES_SEEN } from '../heat/layers.ts';
import type { LayerSource } from '../heat/state.ts';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { PlanLink } from '../load/plan-json.ts';
import type { RouteAndTime } from '../route/state.ts';
import type { ShownStation, StationWorth } from '../stations/shown.ts';
import type { Draft, StationSource } from '../stations/state.ts';
import type { Store } from '../store.ts';
import { type DraftStation, localOf, shownInDraft } from './draft.ts';
import { floorAt } from './review-areas.ts';
import { hasEdits, stationsOf } from './review-stations.ts';

/** Values of layers as the live side has them for one state of the draft. */
export class DraftLayers {
  private readonly held = new Map<string, PatchValues>();

  constructor(private readonly fetchBytes: (path: string) => Promise<ArrayBuffer>) {}

  readonly source: LayerSource = async (layerId) => {
    // Reasons are the plan's: finding them takes longer than anybody waits.
    if (layerId === 'reason') return null;
    const bytes = await this.fetchBytes(`live/layers/${layerId}`);
    const values = layerId === TIMES_SEEN ? new Uint8Array(bytes) : new Uint16Array(bytes);
    this.held.set(layerId, values);
    return values;
  };

  /** Undefined until they were asked for and came. */
  readonly valuesOf = (layerId: string): PatchValues | undefined => this.held.get(layerId);
}

/** The run that goes on and has stations, where runs are looked at; null: there is none. */
export function watchableRun(store: Store): Run | null {
  if (store.tab.value !== 'runs') return null;
  const run = store.reviewClient?.runs.value.find(({ state }) => state === 'running');
  return run?.best?.stations.length ? run : null;
}

export class DraftFollower {
  readonly stations: ReadonlySignal<readonly DraftStation[]>;
  /** Values of the draft that is committed, to take previews back to. */
  readonly layers = signal<DraftLayers | null>(null);
  private readonly endings: (() => void)[];

  constructor(
    private readonly store: Store,
    private readonly reviewClient: ReviewClient,
    private readonly loaded: LoadedPlan,
  ) {
    this.stations = computed(() => stationsOf(store));
    const draft = computed(() => this.draft());
    const layersKey = computed(() => this.layersKey());
    const routeKey = computed(() => this.routeKey());
    this.endings = [
      effect(() => {
        store.draft.value = draft.value;
      }),
      effect(() => this.dropGone()),
      effect(() => {
        store.draftRoute.value = null;
        if (routeKey.value !== null) void this.fetchRoute(routeKey);
      }),
      effect(() => {
        const isWanted = layersKey.value !== null;
        const layers = isWanted ? new DraftLayers((path) => reviewClient.client.bytes(path)) : null;
        this.layers.value = layers;
        store.layerSource.value = layers?.source ?? null;
        store.stationSource.value = isWanted ? this.stationSource() : null;
      }),
    ];
  }

  dispose(): void {
    for (const end of this.endings) end();
    this.store.draft.value = null;
    this.store.layerSource.value = null;
    this.store.stationSource.value = null;
    this.store.draftRoute.value = null;
  }

  /** Nothing of a station stays chosen once the review has it no more, whoever took it out. */
  private dropGone(): void {
    const { store } = this;
    const { stationId, pair, selection, editing } = store;
    const there = new Set(this.stations.value.filter(({ isRemoved }) => !isRemoved).map(({ id }) => id));
    const shown = new Set(store.shownStations.value.map(({ id }) => id));
    stationId.value;
    if (editing.showsPlan.value) return;
    const isGone = (id: string): boolean => !there.has(id) && !shown.has(id);
    untracked(() =>
      batch(() => {
        if (stationId.value !== null && isGone(stationId.value)) store.chooseStation(null);
        if (pair.value?.some(isGone)) store.choosePair(null);
        if ([...selection.value].some(isGone))
          selection.value = new Set([...selection.value].filter((id) => !isGone(id)));
      }),
    );
  }

  /** The route through the draft's stations: fetched only where it is drawn or its length shown, as finding it takes a second and more. */
  private async fetchRoute(routeKey: ReadonlySignal<string | null>): Promise<void> {
    const key = routeKey.peek();
    try {
      const route = await this.reviewClient.client.json<DraftRoute>('live/route');
      if (routeKey.peek() === key) this.store.draftRoute.value = route as RouteAndTime;
    } catch (error) {
      this.reviewClient.warn((error as Error).message);
    }
  }

  /** What stations see that are not where the plan has them; the plan folder has the others. */
  private stationSource(): StationSource {
    const ask = (id: string, what: string): Promise<ArrayBuffer> =>
      this.reviewClient.client.bytes(`live/stations/${encodeURIComponent(id)}/${what}`);
    const fetchOf = (id: string, what: string): Promise<ArrayBuffer> | null => {
      const station = this.stations.peek().find((one) => one.id === id);
      const isChanged = station !== undefined && (station.isAdded || station.movedFromM !== null);
      return isChanged ? ask(id, what) : null;
    };
    return {
      seen: async (id) => {
        const bytes = await fetchOf(id, 'seen');
        return bytes === null ? null : new Uint8Array(bytes);
      },
      // What others no longer see, or now see too, changes it for stations that stayed where they are.
      lost: async (id) => ask(id, 'lost'),
      cloud: async (id) => fetchOf(id, 'cloud'),
    };
  }

  /** Null: the plan as it is. */
  private draft(): Draft | null {
    const { store, reviewClient, loaded } = this;
    const { underWay, preview, showsPlan } = store.editing;
    const best = this.bestOfRun();
    if (best !== null) return { stations: best, links: [] };
    const stations = this.stations.value;
    const moving = underWay.value;
    if (moving === null && (showsPlan.value || !hasEdits(stations))) return null;
    const { offsetM } = loaded.stage;
    const links = reviewClient.figures.value?.registration.links ?? loaded.plan.registration.links;
    const figures = new Map(reviewClient.figures.value?.stations.map((station) => [station.id, station]));
    const shown = shownInDraft(stations, offsetM).map((station) => withWorth(station, figures.get(station.id)));
    if (moving === null) return { stations: shown, links: amongShown(links, shown) };
    const { stationId } = moving;
    const placed = shown.map((station) =>
      station.id === stationId ? { ...station, positionM: localOf(moving.positionM, offsetM) } : station,
    );
    const own = preview.value?.links ?? links.filter(({ a, b }) => a === stationId || b === stationId);
    const others = links.filter(({ a, b }) => a !== stationId && b !== stationId);
    return { stations: placed, links: amongShown([...others, ...own], placed) };
  }

  /** While a run goes on, the best stations it has found so far; null: none does, or nobody looks at them. */
  private bestOfRun(): readonly ShownStation[] | null {
    const { store, loaded } = this;
    const places = store.editing.watchesRun.value ? (watchableRun(store)?.best?.stations ?? []) : [];
    if (places.length === 0) return null;
    const { floors, offsetM } = loaded.stage;
    return places.map((place, i) => {
      const positionM = localOf(place, offsetM);
      return {
        id: t('best {n}', { n: i + 1 }),
        floorId: floorAt(floors, positionM[2]),
        number: i + 1,
        order: i + 1,
        positionM,
        marks: ['added'] as const,
      };
    });
  }

  /** The draft is shown, and the live side computes. */
  private isDraftLive(): boolean {
    const { store, reviewClient } = this;
    const isShown = !store.editing.showsPlan.value && store.planBase.value === OWN_PLAN;
    return isShown && reviewClient.live.value.state === 'ready';
  }

  /** Another key: another route. Null: the plan's, or none is looked at. */
  private routeKey(): string | null {
    const { showRoute, tab } = this.store;
    const isShown = showRoute.value || tab.value === 'plan';
    const stations = this.stations.value;
    const entrances = this.reviewClient.review.value?.entrances ?? {};
    const isOther = hasEdits(stations) || Object.keys(entrances).length > 0;
    if (!isShown || !isOther || !this.isDraftLive()) return null;
    return JSON.stringify([stations.map(({ id, positionM, isRemoved }) => [id, positionM, isRemoved]), entrances]);
  }

  /** Another key: other values. Null: those of the plan folder. */
  private layersKey(): string | null {
    const stations = this.stations.value;
    if (!this.isDraftLive() || (!hasEdits(stations) && this.store.tab.value !== 'edit')) return null;
    return JSON.stringify(stations.map(({ id, positionM, isRemoved }) => [id, positionM, isRemoved]));
  }
}

function withWorth(station: ShownStation, worth: StationWorth | undefined): ShownStation {
  return worth === undefined ? station : { ...station, worth };
}

function amongShown(links: readonly (DraftLink | PlanLink)[], shown: readonly { readonly id: string }[]): PlanLink[] {
  const ids = new Set(shown.map(({ id }) => id));
  return links.filter(({ a, b }) => ids.has(a) && ids.has(b)) as PlanLink[];
}
