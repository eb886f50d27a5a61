/** The 3D side of the viewer: follows the store's signals, and tells it what was clicked. */
import { computed, effect, untracked } from '@preact/signals';
import { Ray, Vector3 } from 'three';
import { extentOf, sliceOfFloor } from '../floors/cut.ts';
import { normalOf } from '../load/edges.ts';
import { fetchCloud, type LoadedPlan } from '../load/fetch-plan.ts';
import { patchCode } from '../load/patch-rule.ts';
import type { StageStation, StageTriangles } from '../load/stage.ts';
import { CloudPoints } from '../stations/cloud-points.ts';
import { LinkLines } from '../stations/link-lines.ts';
import type { Picked, Store } from '../store.ts';
import { Building, NOT_ACHIEVABLE } from './building.ts';
import { DARK, LIGHT } from './palette.ts';
import { type SurfaceHit, SurfacePicker } from './pick.ts';
import { Viewport } from './viewport.ts';
import { weightsAt } from './weights.ts';

/** A press that moves further than this is a drag of the camera, not a click. */
const CLICK_PIXELS = 5;
/** The camera comes this near to a station, in ranges of the scanner. */
const APPROACH_RANGES = 3;
/** Nothing this near to a station hides it: it may stand against a table it was planned beside. */
const OCCLUSION_SLACK_M = 0.15;

/** Where a marker lies on the canvas, in CSS pixels. */
export interface MarkerPlace {
  readonly x: number;
  readonly y: number;
  readonly isHidden: boolean;
}

export class PlanView {
  /** Called after each frame with the places of the markers by station id. */
  onMarkers: (places: ReadonlyMap<string, MarkerPlace>) => void = () => undefined;
  private readonly viewport: Viewport;
  private readonly building: Building;
  private readonly picker: SurfacePicker;
  private readonly links: LinkLines;
  private cloud: CloudPoints | null = null;
  private readonly endings: (() => void)[] = [];

  constructor(
    canvas: HTMLCanvasElement,
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
  ) {
    this.viewport = new Viewport(canvas);
    this.building = new Building(loaded);
    this.picker = new SurfacePicker(this.building.geometry);
    this.links = new LinkLines(loaded);
    this.viewport.scene.add(this.building.group, this.links.lines);
    this.viewport.onFrame = () => this.onMarkers(this.markerPlaces());
    this.followTheme();
    this.followFloors();
    this.followLook();
    this.followStation();
    this.listenToClicks(canvas);
  }

  /** Show everything that is drawn. */
  showAll(from: 'side' | 'top', isInstant = false): void {
    const { slices, extents } = this.store;
    if (extents.value === null) return;
    const { whole, grounds } = extents.value;
    this.viewport.showAll(extentOf(slices.value, whole, grounds), from, isInstant);
  }

  dispose(): void {
    for (const end of this.endings) end();
    this.cloud?.dispose();
    this.links.dispose();
    this.building.dispose();
    this.viewport.dispose();
  }

  private followTheme(): void {
    const dark = window.matchMedia('(prefers-color-scheme: dark)');
    const apply = (): void => {
      const palette = dark.matches ? DARK : LIGHT;
      this.building.setPalette(palette);
      this.links.setPalette(palette);
      this.viewport.setPalette(palette);
    };
    dark.addEventListener('change', apply);
    this.endings.push(() => dark.removeEventListener('change', apply));
    apply();
  }

  private followFloors(): void {
    let isFirst = true;
    this.endings.push(
      effect(() => {
        this.building.setSlices(this.store.slices.value);
        this.viewport.requestFrame();
      }),
      // The camera follows the choice of floor, but not the slider of the cut.
      effect(() => {
        this.store.floorId.value;
        this.store.isSpread.value;
        if (untracked(() => this.store.stationId.value) === null || isFirst) this.showAll('side', isFirst);
        isFirst = false;
      }),
    );
  }

  private followLook(): void {
    const { store } = this;
    const pickedElement = computed(() => highlighted(store.picked.value));
    this.endings.push(
      effect(() => {
        this.building.setLook({
          paint: store.paint.value,
          pickedElement: pickedElement.value,
          isFaded: store.cloud.value.kind === 'shown',
        });
        this.cloud?.setPaint(store.cloudPaint.value);
        this.links.update(store.slices.value, store.showLinks.value, store.stationId.value);
        const station = this.loaded.stage.stations.find(({ id }) => id === store.stationId.value);
        if (station !== undefined) this.cloud?.setSlice(sliceOfFloor(store.slices.value, station.floorId));
        this.viewport.requestFrame();
      }),
    );
  }

  private followStation(): void {
    let fetching = new AbortController();
    this.endings.push(
      () => fetching.abort(),
      effect(() => {
        const station = this.loaded.stage.stations.find(({ id }) => id === this.store.stationId.value);
        fetching.abort();
        fetching = new AbortController();
        untracked(() => {
          this.dropCloud();
          if (station === undefined) return;
          this.flyToStation(station);
          void this.showCloud(station, fetching.signal);
        });
      }),
    );
  }

  private dropCloud(): void {
    if (this.cloud !== null) this.viewport.scene.remove(this.cloud.points);
    this.cloud?.dispose();
    this.cloud = null;
    this.store.cloud.value = { kind: 'none' };
    this.viewport.requestFrame();
  }

  private async showCloud(station: StageStation, signal: AbortSignal): Promise<void> {
    this.store.cloud.value = { kind: 'loading' };
    try {
      const cloud = await fetchCloud(station, signal);
      if (signal.aborted) return;
      this.cloud = new CloudPoints(cloud, station, this.loaded.plan.scanner.range_max_m);
      this.viewport.scene.add(this.cloud.points);
      this.store.cloud.value = { kind: 'shown', nReturns: cloud.nReturns };
    } catch (error) {
      if (!signal.aborted) this.store.cloud.value = { kind: 'failed', message: (error as Error).message };
    }
  }

  private flyToStation(station: StageStation): void {
    const place = this.drawnPlace(station);
    if (place !== null) this.viewport.approach(place, APPROACH_RANGES * this.loaded.plan.scanner.range_max_m);
  }

  private drawnPlace(station: StageStation): Vector3 | null {
    const slice = sliceOfFloor(this.store.slices.peek(), station.floorId);
    if (slice === undefined) return null;
    const [x, y, z] = station.positionM;
    return new Vector3(x, y, z + slice.liftM);
  }

  private markerPlaces(): Map<string, MarkerPlace> {
    const places = new Map<string, MarkerPlace>();
    for (const station of this.loaded.stage.stations) {
      const at = this.drawnPlace(station);
      const place = at && this.viewport.project(at);
      const cover = at && this.coverOf(at);
      // Behind a wall of its own floor a marker is dimmed; behind another floor it would seem to stand there.
      if (!place || (cover && cover.slice.floorId !== null && cover.slice.floorId !== station.floorId)) continue;
      places.set(station.id, { ...place, isHidden: cover !== null });
    }
    return places;
  }

  /** The surface between the camera and a place; null: none. */
  private coverOf(at: Vector3): SurfaceHit | null {
    const eye = this.viewport.camera.position;
    const ray = new Ray(eye.clone(), at.clone().sub(eye).normalize());
    return this.picker.firstHit(ray, this.store.slices.peek(), eye.distanceTo(at) - OCCLUSION_SLACK_M);
  }

  private listenToClicks(canvas: HTMLCanvasElement): void {
    let pressed: { x: number; y: number } | null = null;
    const press = (event: PointerEvent): void => {
      pressed = event.isPrimary && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
    };
    const release = (event: PointerEvent): void => {
      if (pressed === null || Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > CLICK_PIXELS) return;
      pressed = null;
      this.click(event.clientX, event.clientY);
    };
    canvas.addEventListener('pointerdown', press);
    canvas.addEventListener('pointerup', release);
    this.endings.push(() => {
      canvas.removeEventListener('pointerdown', press);
      canvas.removeEventListener('pointerup', release);
    });
  }

  /** A click on ground picks its floor; on anything else it tells what that is; beside the building it lets go. */
  private click(clientX: number, clientY: number): void {
    const ray = this.viewport.rayAt(clientX, clientY);
    const hit = this.picker.firstHit(ray, this.store.slices.value);
    if (hit === null) {
      this.store.pick(null);
      return;
    }
    const picked = this.describe(hit, ray.direction);
    if (picked.groundOf !== null && picked.groundOf !== this.store.floorId.value) {
      this.store.chooseFloor(picked.groundOf);
    }
    this.store.pick(picked);
  }

  private describe(hit: SurfaceHit, beam: Vector3): Picked {
    const { triangles, elements, floors, offsetM } = this.loaded.stage;
    const elementIndex = triangles.element[hit.triangle];
    const seen = this.loaded.patchSeen[patchAt(triangles, hit)];
    const outward = new Vector3(...normalOf(triangles.cornersM, hit.triangle));
    const isSection = this.loaded.edges.bodySide[hit.triangle] * outward.dot(beam) > 0;
    return {
      element: elements[elementIndex],
      elementIndex,
      groundOf: floors.find(({ index }) => index + 1 === triangles.groundOf[hit.triangle])?.id ?? null,
      timesSeen: seen === NOT_ACHIEVABLE || isSection ? null : seen,
      isSection,
      pointM: [hit.pointM.x + offsetM[0], hit.pointM.y + offsetM[1], hit.pointM.z + offsetM[2]],
    };
  }
}

/** Ground keeps its colours: it fills the picture, and its coverage is what is looked at. */
function highlighted(picked: Picked | null): number | null {
  return picked === null || picked.groundOf !== null ? null : picked.elementIndex;
}

function patchAt(triangles: StageTriangles, { triangle, pointM }: SurfaceHit): number {
  const weights = weightsAt(triangles.cornersM, triangle, pointM);
  const [q01, q12, q20] = triangles.squaredEdgesM2.subarray(3 * triangle, 3 * triangle + 3);
  return triangles.firstPatch[triangle] + patchCode(weights, [q01, q12, q20], triangles.patchDepth[triangle]);
}
