/** Holds the shown plan against another one: the difference as a layer of the building, moved stations as arrows. */
import { effect, untracked } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { Arrows } from '../edit/arrows.ts';
import { sliceOfFloor } from '../floors/cut.ts';
import { NOT_ASKED, TIMES_SEEN } from '../heat/layers.ts';
import { withinScope } from '../heat/scope.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { fetchOtherPlan, hasSameDoors } from './comparison.ts';
import { DIFFERENCE_ID, differenceLayer, differenceOf, type StationChange } from './difference.ts';
import { changesShown } from './station-changes.ts';

interface CompareLayerProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly view: PlanView;
}

export function CompareLayer({ store, loaded, view }: CompareLayerProps) {
  useEffect(() => {
    const follower = new CompareFollower(store, loaded, view);
    return () => follower.dispose();
  }, [store, loaded, view]);
  return null;
}

class CompareFollower {
  private readonly arrows = new Arrows();
  private fetching = new AbortController();
  private drawing = new AbortController();
  private readonly endings: (() => void)[];

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly view: PlanView,
  ) {
    this.endings = [
      ...this.arrows.meshes.map((mesh) => view.addOverlay(mesh)),
      effect(() => void this.fetch(store.compareBase.value)),
      effect(() => void this.paint()),
      effect(() => this.drawArrows()),
    ];
  }

  dispose(): void {
    for (const end of this.endings) end();
    this.fetching.abort();
    this.drawing.abort();
    this.arrows.dispose();
    this.dropLayer();
  }

  private async fetch(base: string | null): Promise<void> {
    const { comparison } = this.store;
    this.fetching.abort();
    this.fetching = new AbortController();
    const { signal } = this.fetching;
    if (base === null) {
      comparison.value = { kind: 'none' };
      return;
    }
    comparison.value = { kind: 'loading', base };
    try {
      const other = await fetchOtherPlan(base, signal);
      if (!signal.aborted) comparison.value = { kind: 'shown', other };
    } catch (error) {
      if (!signal.aborted) comparison.value = { kind: 'failed', message: (error as Error).message };
    }
  }

  /** The difference as a layer; of the draft, where one is shown. */
  private async paint(): Promise<void> {
    const { store, loaded } = this;
    const comparison = store.comparison.value;
    const source = store.layerSource.value;
    this.drawing.abort();
    this.drawing = new AbortController();
    const { signal } = this.drawing;
    if (comparison.kind !== 'shown') {
      untracked(() => this.dropLayer());
      return;
    }
    if (!hasSameDoors(loaded.plan, comparison.other.plan)) {
      untracked(() => this.showTimesSeen());
      return;
    }
    try {
      const seen = (await source?.(TIMES_SEEN)) ?? loaded.patchSeen;
      if (signal.aborted) return;
      const values = differenceOf(withinScope(seen as Uint8Array, loaded.scope), comparison.other.patchSeen);
      const { title, base } = comparison.other;
      const layer = differenceLayer(title, base === OWN_PLAN, values.includes(NOT_ASKED));
      store.extraLayers.value = [...this.otherLayers(), { layer, values }];
    } catch (error) {
      if (!signal.aborted) store.comparison.value = { kind: 'failed', message: (error as Error).message };
    }
  }

  private dropLayer(): void {
    const { store } = this;
    if (store.compareBase.peek() === null) this.showTimesSeen();
    else if (store.extraLayers.peek().length > 0) store.extraLayers.value = this.otherLayers();
  }

  /** In place of the difference. */
  private showTimesSeen(): void {
    const { store } = this;
    if (store.extraLayers.peek().length > 0) store.extraLayers.value = this.otherLayers();
    if (store.layerId.peek() === DIFFERENCE_ID) store.layerId.value = TIMES_SEEN;
  }

  private otherLayers() {
    return this.store.extraLayers.peek().filter(({ layer }) => layer.id !== DIFFERENCE_ID);
  }

  private drawArrows(): void {
    const { store } = this;
    const slices = store.slices.value;
    const changes = store.layerId.value === DIFFERENCE_ID ? changesShown(store) : [];
    this.arrows.set(
      changes.flatMap((change) => {
        const slice = sliceOfFloor(slices, change.floorId);
        return slice === undefined ? [] : [lifted(change, slice.liftM)];
      }),
    );
    this.view.requestFrame();
  }
}

function lifted(change: StationChange, liftM: number): StationChange {
  const up = ([x, y, z]: readonly [number, number, number]): [number, number, number] => [x, y, z + liftM];
  if (change.kind === 'moved') return { ...change, fromM: up(change.fromM), toM: up(change.toM) };
  return { ...change, atM: up(change.atM) };
}
