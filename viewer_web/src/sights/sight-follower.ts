/** Finds for each clicked surface which stations see it: bits of each station's file, or what the live side has of edited ones. */

import { effect } from '@preact/signals';
import { localOf } from '../edit/draft.ts';
import { bitWithinLimits, isSeen } from '../heat/marks.ts';
import { t } from '../language/language.ts';
import { normalOf } from '../load/edges.ts';
import { fetchSeenBit, type LoadedPlan } from '../load/fetch-plan.ts';
import type { Picked } from '../scene/state.ts';
import type { ShownStation } from '../stations/shown.ts';
import type { Store } from '../store.ts';
import { sightsOf } from './sights.ts';

export class SightFollower {
  private latest = 0;
  private readonly end: () => void;

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
  ) {
    this.end = effect(() => {
      void this.follow(store.picked.value, store.shownStations.value);
    });
  }

  dispose(): void {
    this.latest = -1;
    this.end();
  }

  private async follow(picked: Picked | null, stations: readonly ShownStation[]): Promise<void> {
    const { store } = this;
    store.stationSource.value;
    const turn = ++this.latest;
    // What no candidate sees, and what the plan is not about, may be seen all the same: that is what is asked.
    if (picked === null || picked.isSection) {
      store.sights.value = { kind: 'none' };
      return;
    }
    store.sights.value = { kind: 'loading' };
    const { offsetM, triangles } = this.loaded.stage;
    const atM = localOf(picked.pointM, offsetM);
    // The station may see the patch where it is nearer than the point: by no more than the triangle is long.
    const longestM = Math.sqrt(
      Math.max(...triangles.squaredEdgesM2.subarray(3 * picked.triangle, 3 * picked.triangle + 3)),
    );
    const reachM = this.loaded.plan.scanner.range_max_m + longestM;
    const near = stations.filter(({ positionM }) => Math.hypot(...positionM.map((x, k) => x - atM[k])) <= reachM);
    try {
      const { asked: limits } = this.loaded.plan.requirements;
      const isLimited = Object.values(limits).some((limit) => limit !== null);
      const seen = await Promise.all(near.map(({ id }) => this.hasBit(id, picked.patch)));
      const seeing = near.filter((_, i) => seen[i]);
      const bit = bitWithinLimits(picked.patch, this.loaded.patchSeen.length);
      // Plans of older versions have no such bits: what is seen is all that they know.
      const isCounted = seeing.map(({ id }) => !isLimited || this.hasBit(id, bit).catch(() => true));
      const counted = await Promise.all(isCounted);
      if (turn !== this.latest) return;
      store.sights.value = {
        kind: 'shown',
        sights: sightsOf(
          seeing.map((station, i) => ({ ...station, isCounted: counted[i] })),
          atM,
          normalOf(triangles.cornersM, picked.triangle),
          limits,
        ),
      };
    } catch (error) {
      if (turn === this.latest) store.sights.value = { kind: 'failed', message: (error as Error).message };
    }
  }

  private async hasBit(id: string, bit: number): Promise<boolean> {
    const live = await this.store.stationSource.peek()?.seen(id);
    if (live) return isSeen(live, bit);
    const station = this.loaded.stage.stations.find((one) => one.id === id);
    if (station === undefined) throw new Error(t('What {id} sees is known with live editing only.', { id }));
    return fetchSeenBit(this.loaded, station, bit);
  }
}
