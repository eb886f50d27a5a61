/**
 * The clouds that are shown: the chosen station's, or those of all stations of the floors that are shown.
 *
 * All together stay within a number of points: beyond it some rows and columns of every cloud are left out. What is hidden gives
 * its memory back, and the others come closer to all of their beams.
 */
import { computed, effect, signal, untracked } from '@preact/signals';
import { Group } from 'three';
import { roundUp } from '../heat/statistics.ts';
import { readCloud, type ThinnedCloud, type Thinning, thinningFor } from '../load/cloud-rows.ts';
import { fetchCloud, type LoadedPlan } from '../load/fetch-plan.ts';
import type { StageStation } from '../load/stage.ts';
import type { Store } from '../store.ts';
import { CloudPoints, usualRangeM } from './cloud-points.ts';
import { beamsOfScan } from './cloud-share.ts';
import type { ShownStation } from './shown.ts';

/** A graphics card of a laptop turns this many smoothly; 3 bytes each. */
const MOST_POINTS = 8_000_000;
const MOST_AT_ONCE = 3;

interface Wanted {
  readonly station: ShownStation;
  readonly thinning: Thinning;
  /** What makes it this cloud and no other. */
  readonly key: string;
}

export class CloudSet {
  readonly group = new Group();
  private readonly shown = new Map<string, CloudPoints>();
  private readonly loading = new Map<string, AbortController>();
  /** Counts changes of `shown`, which is no signal itself. */
  private readonly version = signal(0);
  private readonly failure = signal<string | null>(null);
  private readonly wanted;
  private readonly endings: (() => void)[];

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly requestFrame: () => void,
  ) {
    this.wanted = computed(() => this.wantedNow());
    this.endings = [
      effect(() => {
        const wanted = this.wanted.value;
        untracked(() => this.reconcile(wanted));
      }),
      effect(() => this.paint()),
      effect(() => this.report()),
    ];
  }

  dispose(): void {
    for (const end of this.endings) end();
    for (const key of [...this.loading.keys()]) this.stop(key);
    for (const key of [...this.shown.keys()]) this.drop(key);
  }

  private wantedNow(): readonly Wanted[] {
    const { store } = this;
    const floors = new Set(store.slices.value.map(({ floorId }) => floorId));
    const isOnShownFloor = ({ floorId }: ShownStation): boolean => floors.has(null) || floors.has(floorId);
    // A cloud would stand in front of the coverage that editing is about.
    const isEditing = store.tab.value === 'edit';
    const isSwitchedOn = ({ id }: ShownStation): boolean =>
      id === store.stationId.value || !store.hiddenClouds.value.has(id);
    const stations = store.showClouds.value
      ? store.shownStations.value.filter((station) => isOnShownFloor(station) && isSwitchedOn(station))
      : store.shownStations.value.filter(
          ({ id }) => id === store.stationId.value && !store.isWalking.value && !isEditing,
        );
    const source = store.stationSource.value;
    return stations.flatMap((station) => {
      const beams = this.beamsOf(station);
      if (beams === undefined) return [];
      const thinning = thinningFor(beams, stations.length, MOST_POINTS);
      const key = [
        station.id,
        thinning.everyRow,
        thinning.everyColumn,
        ...(source === null ? [] : station.positionM),
      ].join(' ');
      return [{ station, thinning, key }];
    });
  }

  /** All stations scan alike: one that the plan does not have sends out the beams of one that it has. */
  private beamsOf({ id, positionM }: ShownStation): StageStation | undefined {
    const { stations } = this.loaded.stage;
    const own = stations.find((station) => station.id === id);
    return own ?? (stations[0] && { ...stations[0], id, positionM, cloudUri: `clouds/${id}.cloud` });
  }

  private reconcile(wanted: readonly Wanted[]): void {
    const keys = new Set(wanted.map(({ key }) => key));
    for (const key of [...this.loading.keys()]) if (!keys.has(key)) this.stop(key);
    for (const key of [...this.shown.keys()]) if (!keys.has(key)) this.drop(key);
    this.failure.value = null;
    this.version.value++;
    this.loadNext();
  }

  /** A few at a time, in the order wanted; each that is done begins the next. */
  private loadNext(): void {
    while (this.loading.size < MOST_AT_ONCE && this.failure.peek() === null) {
      const next = this.wanted.peek().find(({ key }) => !this.shown.has(key) && !this.loading.has(key));
      if (next === undefined) return;
      const stopping = new AbortController();
      this.loading.set(next.key, stopping);
      void this.load(next, stopping);
    }
  }

  private async load(wanted: Wanted, stopping: AbortController): Promise<void> {
    try {
      const thinned = await this.fetch(wanted, stopping.signal);
      if (stopping.signal.aborted) return;
      const points = new CloudPoints(thinned, wanted.station);
      this.shown.set(wanted.key, points);
      this.group.add(points.points);
    } catch (error) {
      if (!stopping.signal.aborted) this.failure.value = (error as Error).message;
    } finally {
      if (this.loading.get(wanted.key) === stopping) this.loading.delete(wanted.key);
    }
    if (stopping.signal.aborted) return;
    this.version.value++;
    this.loadNext();
  }

  private async fetch({ station, thinning }: Wanted, signal: AbortSignal): Promise<ThinnedCloud> {
    const beams = this.beamsOf(station) as StageStation;
    const live = await this.store.stationSource.peek()?.cloud(station.id);
    if (!live) return fetchCloud(this.loaded.base, beams, thinning, signal);
    return readCloud(new Blob([live]).stream(), beams, thinning, true);
  }

  private stop(key: string): void {
    this.loading.get(key)?.abort();
    this.loading.delete(key);
  }

  private drop(key: string): void {
    const points = this.shown.get(key);
    if (points === undefined) return;
    this.group.remove(points.points);
    points.dispose();
    this.shown.delete(key);
  }

  private paint(): void {
    this.version.value;
    const paint = this.store.cloudPaint.value;
    const slices = this.store.slices.value;
    const farthestM = roundUp(Math.max(0, ...[...this.shown.values()].map(({ thinned }) => usualRangeM(thinned))));
    for (const points of this.shown.values()) {
      points.setPaint(paint, farthestM);
      points.setSlices(slices);
    }
    this.store.cloudFarthestM.value = farthestM;
    this.requestFrame();
  }

  private report(): void {
    this.version.value;
    const wanted = this.wanted.value;
    const failure = this.failure.value;
    const clouds = [...this.shown.values()];
    const { cloud, chosenCloud, stationId } = this.store;
    const chosen = wanted.find(({ station }) => station.id === stationId.value);
    const points = chosen && this.shown.get(chosen.key);
    chosenCloud.value = points === undefined ? null : { stationId: chosen?.station.id ?? '', ...points.thinned };
    if (failure !== null) cloud.value = { kind: 'failed', message: failure };
    else if (wanted.length === 0) cloud.value = { kind: 'none' };
    else if (clouds.length < wanted.length) cloud.value = { kind: 'loading', n: clouds.length, of: wanted.length };
    else {
      const nReturns = clouds.reduce((sum, { thinned }) => sum + thinned.cloud.nReturns, 0);
      const nBeams = clouds.reduce((sum, { thinned }) => sum + thinned.cloud.rangeSteps.length, 0);
      const nScanned = clouds.length * beamsOfScan(this.loaded.plan.scanner);
      cloud.value = { kind: 'shown', nReturns, nStations: clouds.length, nBeams, nScanned };
    }
  }
}
