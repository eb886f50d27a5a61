/** Paints the building by the layer that the store names: fetches its values, keeps them, takes changes of them. */

import { effect } from '@preact/signals';
import { DIFFERENCE_ID } from '../compare/difference.ts';
import { t } from '../language/language.ts';
import { fetchPatchValues, type LoadedPlan } from '../load/fetch-plan.ts';
import { ROOM_COVERAGE } from '../rooms/rooms.ts';
import type { Building } from '../scene/building.ts';
import type { Palette } from '../scene/palette.ts';
import type { Store } from '../store.ts';
import { layerColors } from './colors.ts';
import { type HeatLayer, NOT_ASKED, type PatchValues, PLAIN, TIMES_SEEN, valuesOf } from './layers.ts';
import { withinScope, withinScopeAt } from './scope.ts';
import type { LayerSource } from './state.ts';
import { patchAreas, type Spread, spreadOf } from './statistics.ts';

export class PatchPaint {
  /** How many stations see each patch, as it is shown now. */
  timesSeen: Uint8Array;
  private shown: { readonly layer: HeatLayer; readonly values: PatchValues } | null = null;
  private spread: Spread | null = null;
  private source: LayerSource | null = null;
  private loading = new AbortController();
  private palette: Palette | null = null;
  private areasM2: Float32Array | null = null;
  private readonly kept = new Map<string, PatchValues>();
  private readonly endings: (() => void)[];

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly building: Building,
    private readonly requestFrame: () => void,
  ) {
    this.timesSeen = loaded.patchSeen.slice();
    this.endings = [effect(() => void this.follow()), () => this.loading.abort()];
  }

  /** Area of each patch that counts; computed when first asked for. */
  get areas(): Float32Array {
    this.areasM2 ??= patchAreas(this.loaded.stage.triangles, this.timesSeen.length, this.loaded.counted);
    return this.areasM2;
  }

  setPalette(palette: Palette): void {
    this.palette = palette;
    this.paint();
  }

  /** New values of all patches; those of a layer that is not shown are left for the store's `layerSource` to give later. */
  setValues(id: string, values: PatchValues): void {
    if (id === TIMES_SEEN) {
      // A copy: changes of single patches are written into it.
      this.timesSeen = withinScope(Uint8Array.from(values), this.loaded.scope);
      this.building.setTimesSeen(this.timesSeen);
      this.countSeen();
    }
    if (this.shown !== null && valuesOf(this.shown.layer) === id) this.show(this.shown.layer, values);
    this.requestFrame();
  }

  /** Values of a layer that is computed here, of no plan folder and no server: shown, now or once it is chosen. */
  keep(id: string, values: PatchValues): void {
    this.kept.set(id, values);
    const layer = this.store.layers.peek().find((one) => one.id === id);
    if (layer !== undefined && this.store.layerId.peek() === id) this.show(layer, values);
    this.requestFrame();
  }

  /** New values of some patches; `values` are of the layer `id`, dropped where another is shown by now. */
  patch(
    indices: ArrayLike<number>,
    timesSeen: ArrayLike<number> | null,
    id: string,
    values: ArrayLike<number> | null,
  ): void {
    const isShown = this.shown !== null && valuesOf(this.shown.layer) === id && id !== TIMES_SEEN;
    const seen = timesSeen && withinScopeAt(indices, timesSeen, this.loaded.scope);
    for (let i = 0; i < indices.length; i++) {
      if (seen !== null) this.timesSeen[indices[i]] = seen[i];
      if (isShown && values !== null && this.shown !== null) this.shown.values[indices[i]] = values[i];
    }
    this.building.patch(indices, seen, isShown ? values : null);
    if (seen !== null) this.countSeen();
    this.requestFrame();
  }

  /** Value of a patch in the layer that is shown; null: none is, or it has none there. */
  valueAt(patch: number): { readonly layer: HeatLayer; readonly value: number } | null {
    if (this.shown === null) return null;
    const { layer, values } = this.shown;
    const value = valuesOf(layer) === TIMES_SEEN ? this.timesSeen[patch] : values[patch];
    const hasNone = layer.kind === 'ramp' && (value === layer.none || this.timesSeen[patch] === NOT_ASKED);
    return hasNone ? null : { layer, value };
  }

  dispose(): void {
    for (const end of this.endings) end();
  }

  private countSeen(): void {
    this.store.seenRevision.value = this.store.seenRevision.peek() + 1;
  }

  private async follow(): Promise<void> {
    const { store } = this;
    const layer = store.layers.value.find(({ id }) => id === store.layerId.value) ?? null;
    const source = store.layerSource.value;
    const extra = store.extraLayers.value.find(({ layer: { id } }) => id === layer?.id);
    this.loading.abort();
    this.loading = new AbortController();
    const { signal } = this.loading;
    try {
      if (source !== this.source) {
        const seen = (await source?.(TIMES_SEEN)) ?? this.loaded.patchSeen;
        if (signal.aborted) return;
        this.source = source;
        this.setValues(TIMES_SEEN, seen);
      }
      if (layer === null) this.hideAll(store.layerId.value);
      else if (valuesOf(layer) === TIMES_SEEN) this.show(layer, this.timesSeen);
      else if (layer.id === ROOM_COVERAGE) {
        const values = this.kept.get(layer.id);
        if (values === undefined) store.layerState.value = { kind: 'loading', layer };
        else this.show(layer, values);
      } else {
        store.layerState.value = { kind: 'loading', layer };
        const values =
          extra?.values ?? (await source?.(valuesOf(layer))) ?? (await this.fetch(valuesOf(layer), signal));
        if (!signal.aborted) this.show(layer, values);
      }
    } catch (error) {
      if (signal.aborted) return;
      this.hide();
      store.layerState.value = { kind: 'failed', message: (error as Error).message };
    }
    this.requestFrame();
  }

  private fetch(id: string, signal: AbortSignal): Promise<PatchValues> {
    return fetchPatchValues(this.loaded, id, signal);
  }

  private hideAll(layerId: string): void {
    this.hide();
    // A comparison tells by itself how far it is, and why it can't be.
    if (layerId === PLAIN || layerId === DIFFERENCE_ID) return;
    const message = t('This plan has no layer "{id}": an older version made it. Plan again to see it.', {
      id: layerId,
    });
    this.store.layerState.value = { kind: 'failed', message };
  }

  private hide(): void {
    this.shown = null;
    this.building.setValues(null);
    this.store.layerState.value = { kind: 'none' };
    this.paint();
  }

  private show(layer: HeatLayer, values: PatchValues): void {
    const isSeen = valuesOf(layer) === TIMES_SEEN;
    // A copy: changes of single patches are written into it.
    this.shown = { layer, values: isSeen ? this.timesSeen : values.slice() };
    this.building.setValues(isSeen ? null : values);
    const spread = layer.kind === 'ramp' ? spreadOf(values, layer, this.areas, this.timesSeen) : null;
    this.spread = spread;
    this.store.layerState.value = { kind: 'shown', layer, spread };
    this.paint();
  }

  private paint(): void {
    const { palette, shown, spread } = this;
    if (palette === null) return;
    if (shown === null) this.building.setPaint({ mode: 'plain' });
    else {
      const { layer } = shown;
      const colors = layerColors(layer, palette.isDark);
      if (layer.kind === 'classes' || spread === null) this.building.setPaint({ mode: 'classes', colors });
      else {
        const [low, high] = [spread.low / layer.step, spread.high / layer.step];
        this.building.setPaint({ mode: 'ramp', colors, low, high, none: layer.none });
      }
    }
    this.requestFrame();
  }
}
