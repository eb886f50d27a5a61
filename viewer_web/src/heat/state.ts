/** What the building is painted by, and what is highlighted in it. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import { rampLayersOf } from '../load/layers.ts';
import type { LoadState } from '../load/state.ts';
import { roomLayer } from '../rooms/rooms.ts';
import { type HeatLayer, layersOf, type PatchValues, TIMES_SEEN } from './layers.ts';
import type { Spread } from './statistics.ts';

/** Values of a layer for all patches; null: this source has none, those of the plan folder are shown. */
export type LayerSource = (layerId: string) => Promise<PatchValues | null>;

/** A layer besides those of the plan folder, such as a difference to another plan, with its values. */
export interface ExtraLayer {
  readonly layer: HeatLayer;
  readonly values: PatchValues;
}

export type LayerState =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading'; readonly layer: HeatLayer }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly layer: HeatLayer; readonly spread: Spread | null };

/** What is highlighted in place of the layer: what a pair shares, an unseen piece, or what one station alone sees. */
export type Marking =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading' }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'shown'; readonly areaM2: number };

export interface HeatState {
  /** What the building is painted by: the id of a layer, or `PLAIN`. */
  readonly layerId: Signal<string>;
  readonly extraLayers: Signal<readonly ExtraLayer[]>;
  /** All that it can be painted by. */
  readonly layers: ReadonlySignal<readonly HeatLayer[]>;
  /** What became of it. */
  readonly layerState: Signal<LayerState>;
  /** Where values of layers come from before the plan folder is asked. */
  readonly layerSource: Signal<LayerSource | null>;
  readonly marking: Signal<Marking>;
  /** Grows with every change of how many stations see the patches that are shown. */
  readonly seenRevision: Signal<number>;
}

export function createHeatState({ loaded }: LoadState): HeatState {
  const extraLayers = signal<readonly ExtraLayer[]>([]);
  return {
    layerId: signal(TIMES_SEEN),
    extraLayers,
    layers: computed(() => {
      const layers = loaded.value?.layers ?? null;
      const required = loaded.value?.plan.requirements.coverage ?? 0;
      const ofRooms = layers?.rooms?.list.length ? [roomLayer(required)] : [];
      const extra = extraLayers.value.map(({ layer }) => layer);
      return layersOf(rampLayersOf(layers), layers?.reasons ?? [], [...ofRooms, ...extra]);
    }),
    layerState: signal<LayerState>({ kind: 'none' }),
    layerSource: signal<LayerSource | null>(null),
    marking: signal<Marking>({ kind: 'none' }),
    seenRevision: signal(0),
  };
}
