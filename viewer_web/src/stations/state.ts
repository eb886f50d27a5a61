/** Which stations are shown, which is chosen, and what of them: the cloud, and what only it sees. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { ThinnedCloud } from '../load/cloud-rows.ts';
import type { PlanLink } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';
import { type CoveredStations, NONE_COVERED } from './covered.ts';
import { type ShownStation, shownStationsOf } from './shown.ts';

export type CloudPaint = 'range' | 'incidence' | 'intensity' | 'station';

/** What stations see where they are not those of the plan folder; null: the plan folder knows. */
export interface StationSource {
  /** One bit a patch. */
  seen(stationId: string): Promise<Uint8Array | null>;
  /** Bytes as of viewer/lost/*.u32. */
  lost(stationId: string): Promise<ArrayBuffer | null>;
  /** Bytes as of viewer/clouds/*.u16. */
  cloud(stationId: string): Promise<ArrayBuffer | null>;
}

/** Stations and links that are shown in place of the plan's. */
export interface Draft {
  readonly stations: readonly ShownStation[];
  readonly links: readonly PlanLink[];
}

export type CloudState =
  | { readonly kind: 'none' }
  | { readonly kind: 'loading'; readonly n: number; readonly of: number }
  | { readonly kind: 'failed'; readonly message: string }
  /** Of every cloud each `stride`-th beam of each `stride`-th row. */
  | { readonly kind: 'shown'; readonly nReturns: number; readonly nStations: number; readonly stride: number };

export interface StationState {
  readonly draft: Signal<Draft | null>;
  /** Of the draft, else of the plan. */
  readonly shownStations: ReadonlySignal<readonly ShownStation[]>;
  readonly stationSource: Signal<StationSource | null>;
  readonly stationId: Signal<string | null>;
  /** Stations that other floors hide in the picture. */
  readonly covered: Signal<CoveredStations>;
  /** Point out what only the chosen station sees. */
  readonly showsOwn: Signal<boolean>;
  /** Of what would be lost with the station, what this requirement would lose; null: all of it. */
  readonly ownRequirement: Signal<string | null>;
  readonly cloud: Signal<CloudState>;
  readonly cloudPaint: Signal<CloudPaint>;
  /** The clouds of all stations of the shown floors, not the chosen one's alone. */
  readonly showClouds: Signal<boolean>;
  /** End of the colours by range. */
  readonly cloudFarthestM: Signal<number>;
  /** The chosen station's, once it is there. */
  readonly chosenCloud: Signal<(ThinnedCloud & { readonly stationId: string }) | null>;
}

export function createStationState({ loaded }: LoadState): StationState {
  const draft = signal<Draft | null>(null);
  return {
    draft,
    shownStations: computed(() => draft.value?.stations ?? shownStationsOf(loaded.value)),
    stationSource: signal<StationSource | null>(null),
    stationId: signal<string | null>(null),
    covered: signal(NONE_COVERED),
    showsOwn: signal(false),
    ownRequirement: signal<string | null>(null),
    cloud: signal<CloudState>({ kind: 'none' }),
    cloudPaint: signal<CloudPaint>('range'),
    showClouds: signal(false),
    cloudFarthestM: signal(1),
    chosenCloud: signal<(ThinnedCloud & { readonly stationId: string }) | null>(null),
  };
}
