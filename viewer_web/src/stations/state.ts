/** Which stations are shown, which is chosen, and what of them: the cloud, and what only it sees. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import type { ThinnedCloud } from '../load/cloud-rows.ts';
import type { PlanLink } from '../load/plan-json.ts';
import type { LoadState } from '../load/state.ts';
import { type CoveredStations, NONE_COVERED } from './covered.ts';
import type { Look } from './panorama-look.ts';
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
  /** nBeams, nScanned : beams that are drawn, with a return or without, and that the scanner sends out at these stations. */
  | {
      readonly kind: 'shown';
      readonly nReturns: number;
      readonly nStations: number;
      readonly nBeams: number;
      readonly nScanned: number;
    };

/** A part of a cloud in more detail, as one looks closer; nBeams, nScanned : drawn, and that the scanner sends there. */
export interface CloudDetail {
  readonly stationId: string;
  readonly nBeams: number;
  readonly nScanned: number;
}

export interface StationState {
  readonly draft: Signal<Draft | null>;
  /** Of the draft, else of the plan. */
  readonly shownStations: ReadonlySignal<readonly ShownStation[]>;
  readonly stationSource: Signal<StationSource | null>;
  readonly stationId: Signal<string | null>;
  /** Several stations that are changed together; empty: none, or the chosen one alone. */
  readonly selection: Signal<ReadonlySet<string>>;
  /** Clicks add to it without Shift, as for fingers. */
  readonly selectsSeveral: Signal<boolean>;
  /** Stations that other floors hide in the picture. */
  readonly covered: Signal<CoveredStations>;
  /** Point out what only the chosen station sees. */
  readonly showsOwn: Signal<boolean>;
  /** Of what would be lost with the station, what this requirement would lose; null: all of it. */
  readonly ownRequirement: Signal<string | null>;
  readonly cloud: Signal<CloudState>;
  readonly cloudDetail: Signal<CloudDetail | null>;
  readonly cloudPaint: ReadonlySignal<CloudPaint>;
  /** Null: by range, and clouds of all stations by station. */
  readonly chosenPaint: Signal<CloudPaint | null>;
  /** The clouds of all stations of the shown floors, not the chosen one's alone. */
  readonly showClouds: Signal<boolean>;
  /** Of all stations together, those whose clouds are switched off. */
  readonly hiddenClouds: Signal<ReadonlySet<string>>;
  /** End of the colours by range. */
  readonly cloudFarthestM: Signal<number>;
  /** Which way one looks in the panorama, at whichever station; null: all around at once. */
  readonly panoramaLook: Signal<Look | null>;
  /** The chosen station's, once it is there. */
  readonly chosenCloud: Signal<(ThinnedCloud & { readonly stationId: string }) | null>;
}

export function createStationState({ loaded }: LoadState): StationState {
  const draft = signal<Draft | null>(null);
  const showClouds = signal(false);
  const chosenPaint = signal<CloudPaint | null>(null);
  return {
    draft,
    shownStations: computed(() => draft.value?.stations ?? shownStationsOf(loaded.value)),
    stationSource: signal<StationSource | null>(null),
    stationId: signal<string | null>(null),
    selection: signal<ReadonlySet<string>>(new Set()),
    selectsSeveral: signal(false),
    covered: signal(NONE_COVERED),
    showsOwn: signal(false),
    ownRequirement: signal<string | null>(null),
    cloud: signal<CloudState>({ kind: 'none' }),
    cloudDetail: signal<CloudDetail | null>(null),
    cloudPaint: computed(() => chosenPaint.value ?? (showClouds.value ? 'station' : 'range')),
    chosenPaint,
    showClouds,
    hiddenClouds: signal<ReadonlySet<string>>(new Set()),
    cloudFarthestM: signal(1),
    panoramaLook: signal<Look | null>(null),
    chosenCloud: signal<(ThinnedCloud & { readonly stationId: string }) | null>(null),
  };
}
