/**
 * More of a cloud as one looks closer: of the chosen station, or of the one nearest to what is looked at, the live server scans what
 * the picture shows with as many beams as are worth their bytes. The station's own cloud stays as it is, beneath.
 */
import { effect, untracked } from '@preact/signals';
import { Group } from 'three';
import type { CloudHead } from '../api/documents.ts';
import { isLive } from '../edit/readiness.ts';
import type { ThinnedCloud } from '../load/cloud-rows.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { Store } from '../store.ts';
import { CloudPoints } from './cloud-points.ts';
import { beamsOfScan } from './cloud-share.ts';
import { type CloudWindow, shareOfScan, windowOf } from './cloud-window.ts';
import type { ShownStation } from './shown.ts';

/** So long the camera has to stand still. */
const PAUSE_MS = 400;
/** As the server sends them: 3 MB. */
const MOST_BEAMS = 1_000_000;
/** Less is not worth asking for. */
const LEAST_GAIN = 2;
/** More of a scan than this is no closer look. */
const MOST_SHARE = 0.4;

/** What the camera shows: local metres. */
export interface Sight {
  /** Changes with the camera and with what is drawn. */
  pose(): string;
  /** Of surfaces, here and there in the picture. */
  places(): readonly (readonly [number, number, number])[];
  target(): readonly [number, number, number];
}

export class CloudDetailFollower {
  readonly group = new Group();
  private points: CloudPoints | null = null;
  private pose = '';
  private pause = 0;
  private asking: AbortController | null = null;
  private readonly endings: (() => void)[];

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly sight: Sight,
    private readonly requestFrame: () => void,
  ) {
    this.endings = [
      effect(() => {
        // Of another station, of another draft, or of clouds that are gone.
        store.stationId.value;
        store.cloud.value;
        store.shownStations.value;
        const isReady = store.hasPicture.value && isLive(store) && store.planBase.value === OWN_PLAN;
        untracked(() => {
          this.letGo();
          if (isReady) this.wait();
        });
      }),
      effect(() => {
        store.cloudDetail.value;
        this.points?.setPaint(store.cloudPaint.value, store.cloudFarthestM.value);
        this.points?.setSlices(store.slices.value);
        requestFrame();
      }),
    ];
  }

  /** Called after each drawn frame. */
  onFrame(): void {
    if (this.store.cloud.peek().kind !== 'shown' || !isLive(this.store) || !this.store.hasPicture.peek()) return;
    const pose = this.sight.pose();
    if (pose === this.pose) return;
    this.pose = pose;
    this.wait();
  }

  dispose(): void {
    for (const end of this.endings) end();
    window.clearTimeout(this.pause);
    this.letGo();
  }

  private wait(): void {
    window.clearTimeout(this.pause);
    this.pause = window.setTimeout(() => void this.look(), PAUSE_MS);
  }

  private async look(): Promise<void> {
    const [station, client] = [this.station(), this.store.reviewClient?.client];
    const shown = station && this.windowFor(station);
    if (!station || !shown || client === undefined) {
      this.letGo();
      return;
    }
    this.asking?.abort();
    const asking = new AbortController();
    this.asking = asking;
    const { azimuthRad, widthRad, lowRad, highRad } = shown;
    // Not rounded: straight down would become lower than that, which the server refuses.
    const query = `azimuth=${azimuthRad}&width=${widthRad}&low=${lowRad}&high=${highRad}`;
    try {
      const path = `live/stations/${encodeURIComponent(station.id)}/cloud-window?${query}`;
      const { head, body } = await client.framed<CloudHead>(path, asking.signal);
      if (!asking.signal.aborted) this.show(station, head, body);
    } catch (error) {
      // What was there before stays, and says of itself how much it is.
      if (!asking.signal.aborted) this.store.reviewClient?.warn((error as Error).message);
    }
  }

  private station(): ShownStation | null {
    const { store } = this;
    if (store.cloud.peek().kind !== 'shown') return null;
    const stations = store.shownStations.peek();
    const chosen = stations.find(({ id }) => id === store.stationId.peek());
    if (chosen !== undefined || !store.showClouds.peek()) return chosen ?? null;
    const floors = new Set(store.slices.peek().map(({ floorId }) => floorId));
    const isOn = ({ id, floorId }: ShownStation): boolean =>
      !store.hiddenClouds.peek().has(id) && (floors.has(null) || floors.has(floorId));
    const target = this.sight.target();
    const farM = ({ positionM }: ShownStation): number => Math.hypot(...positionM.map((x, i) => x - target[i]));
    return stations.filter(isOn).sort((a, b) => farM(a) - farM(b))[0] ?? null;
  }

  /** What of the station's scan is in the picture; null: looking there shows hardly more than is shown already. */
  private windowFor({ positionM }: ShownStation): CloudWindow | null {
    const { plan, stage } = this.loaded;
    const found = windowOf(positionM, this.sight.places(), plan.scanner.range_max_m);
    const shown = this.store.cloud.peek();
    if (found === null || shown.kind !== 'shown' || stage.stations[0] === undefined) return null;
    const share = shareOfScan(found, stage.stations[0].elevationsRad);
    if (share === 0 || share > MOST_SHARE) return null;
    const gain = Math.min(1, MOST_BEAMS / (share * beamsOfScan(plan.scanner))) / (shown.nBeams / shown.nScanned);
    return gain >= LEAST_GAIN ? found : null;
  }

  private show(station: ShownStation, head: CloudHead, body: ArrayBuffer): void {
    this.drop();
    const thinned = thinnedOf(head, body);
    this.points = new CloudPoints(thinned, station);
    this.group.add(this.points.points);
    this.store.cloudDetail.value = {
      stationId: station.id,
      nBeams: head.rows * head.columns,
      nScanned: head.beams,
    };
    this.requestFrame();
  }

  private letGo(): void {
    this.asking?.abort();
    this.asking = null;
    this.pose = '';
    this.drop();
    this.store.cloudDetail.value = null;
  }

  private drop(): void {
    if (this.points === null) return;
    this.group.remove(this.points.points);
    this.points.dispose();
    this.points = null;
    this.requestFrame();
  }
}

function thinnedOf(head: CloudHead, body: ArrayBuffer): ThinnedCloud {
  const n = head.rows * head.columns;
  const rangeSteps = new Uint16Array(body, 0, n);
  let nReturns = 0;
  for (const steps of rangeSteps) if (steps > 0) nReturns++;
  return {
    cloud: { rangeSteps, intensity: new Uint8Array(body, 2 * n, n), nReturns },
    beams: {
      rows: head.rows,
      columns: head.columns,
      rangeStepM: head.range_step_m,
      elevationsRad: Float32Array.from(head.elevations_rad),
      azimuthsRad: Float32Array.from(head.azimuths_rad),
      azimuthStepRad: head.azimuth_step_rad,
    },
  };
}
