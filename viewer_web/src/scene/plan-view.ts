/** The 3D side of the viewer: follows the store's signals, and tells it what was clicked. */
import { computed, effect, untracked } from '@preact/signals';
import { type Object3D, Ray, Vector3 } from 'three';
import { extentOf, sliceOfFloor, WHOLE_BUILDING } from '../floors/cut.ts';
import { NOT_ACHIEVABLE, type PatchValues } from '../heat/layers.ts';
import { MarkFollower } from '../heat/mark-follower.ts';
import { PatchPaint } from '../heat/patch-paint.ts';
import { normalOf } from '../load/edges.ts';
import { fetchCloud, type LoadedPlan } from '../load/fetch-plan.ts';
import { patchCode } from '../load/patch-rule.ts';
import type { PlanLink } from '../load/plan-json.ts';
import type { StageStation, StageTriangles } from '../load/stage.ts';
import { countingOf, counts } from '../network/graph.ts';
import { CloudPoints } from '../stations/cloud-points.ts';
import { LinkLines, type LinksShown } from '../stations/link-lines.ts';
import type { ShownStation } from '../stations/shown.ts';
import type { Pair, Picked, Store, UnseenFocus } from '../store.ts';
import { Building } from './building.ts';
import { DARK, LIGHT } from './palette.ts';
import { PatchPlaces } from './patch-places.ts';
import { type SurfaceHit, SurfacePicker } from './pick.ts';
import { Pointer, type PointerConsumer } from './pointer.ts';
import { viewOf } from './viewpoint.ts';
import { Viewport } from './viewport.ts';
import { weightsAt } from './weights.ts';

/** The camera comes this near to a station, in ranges of the scanner. */
const APPROACH_RANGES = 3;
/** In solids and behind panels nothing is free for this long. */
const NEAR_SURFACE_M = 0.5;
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
  /** What the pointer does on the canvas and on markers. */
  readonly pointer: Pointer;
  private readonly viewport: Viewport;
  private readonly building: Building;
  private readonly patchPaint: PatchPaint;
  private readonly marks: MarkFollower;
  private readonly picker: SurfacePicker;
  private patchPlaces: PatchPlaces | null = null;
  private readonly links: LinkLines;
  private cloud: CloudPoints | null = null;
  private readonly endings: (() => void)[] = [];

  constructor(
    canvas: HTMLCanvasElement,
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
  ) {
    this.pointer = new Pointer(
      canvas,
      (x, y) => this.click(x, y),
      (isTaken) => this.viewport.holdCamera(isTaken),
    );
    this.viewport = new Viewport(canvas);
    this.building = new Building(loaded);
    this.patchPaint = new PatchPaint(store, loaded, this.building, () => this.requestFrame());
    this.picker = new SurfacePicker(this.building.geometry);
    this.marks = new MarkFollower(
      store,
      loaded,
      this.building,
      this.patchPaint,
      () => this.places,
      () => this.requestFrame(),
    );
    this.links = new LinkLines();
    this.viewport.scene.add(this.building.group, this.links.group);
    this.viewport.onFrame = () => this.onMarkers(this.markerPlaces());
    this.viewport.onResize = (width, height) => this.links.setResolution(width, height);
    this.followTheme();
    this.followFloors();
    this.followLook();
    this.followLinks();
    this.followStation();
    this.followUnseen();
    this.followCamera();
  }

  /** Show everything that is drawn. */
  showAll(from: 'side' | 'top', isInstant = false): void {
    const { slices, extents } = this.store;
    if (extents.value === null) return;
    const { whole, grounds } = extents.value;
    this.viewport.showAll(extentOf(slices.value, whole, grounds), from, isInstant);
  }

  /** Draw soon; needed after a change of an overlay. */
  requestFrame(): void {
    this.viewport.requestFrame();
  }

  /**
   * Draw an object with the building: local frame, metres, and lifted as its floor is (`liftOf`). Returns what takes it away;
   * who made it disposes of it.
   */
  addOverlay(object: Object3D): () => void {
    this.viewport.scene.add(object);
    this.requestFrame();
    return () => {
      this.viewport.scene.remove(object);
      this.requestFrame();
    };
  }

  /** Offer presses, drags and clicks to a consumer before the camera gets them. Returns what takes it away. */
  onPointer(consumer: PointerConsumer): () => void {
    return this.pointer.add(consumer);
  }

  /** New values of all patches of a layer: `times_seen` or one of the store's layers. */
  setPatchValues(layerId: string, values: PatchValues): void {
    this.patchPaint.setValues(layerId, values);
  }

  /** New values of some patches; `values` belong to the layer `layerId`, null: only how many stations see them. */
  patchPatches(
    indices: ArrayLike<number>,
    timesSeen: ArrayLike<number> | null,
    layerId: string,
    values: ArrayLike<number> | null,
  ): void {
    this.patchPaint.patch(indices, timesSeen, layerId, values);
  }

  /** How many stations see each patch, as shown now. */
  get timesSeen(): Uint8Array {
    return this.patchPaint.timesSeen;
  }

  /** Area of each patch, m². */
  get patchAreasM2(): Float32Array {
    return this.patchPaint.areas;
  }

  /** The surface under a place of the page; null: none. */
  surfaceAt(clientX: number, clientY: number): Picked | null {
    const ray = this.viewport.rayAt(clientX, clientY);
    const hit = this.picker.firstHit(ray, this.store.slices.peek());
    return hit === null ? null : this.describe(hit, ray.direction);
  }

  /** Where the ray under a place of the page meets the level `heightM` (local) of a floor; null: it does not. */
  levelAt(clientX: number, clientY: number, floorId: string, heightM: number): [number, number, number] | null {
    const ray = this.viewport.rayAt(clientX, clientY);
    const far = (heightM + this.liftOf(floorId) - ray.origin.z) / ray.direction.z;
    if (!(far > 0 && Number.isFinite(far))) return null;
    const at = ray.at(far, new Vector3());
    return [at.x, at.y, heightM];
  }

  /** By how much what belongs to a floor is drawn higher than it is. */
  liftOf(floorId: string): number {
    return sliceOfFloor(this.store.slices.peek(), floorId)?.liftM ?? 0;
  }

  /** Place of a point (local, not lifted) of a floor on the canvas in CSS pixels; null: behind the camera. */
  project(pointM: readonly [number, number, number], floorId: string): { x: number; y: number } | null {
    const [x, y, z] = pointM;
    return this.viewport.project(new Vector3(x, y, z + this.liftOf(floorId)));
  }

  /** Come near to a point (local, not lifted) of a floor. */
  approach(pointM: readonly [number, number, number], floorId: string): void {
    const [x, y, z] = pointM;
    const place = new Vector3(x, y, z + this.liftOf(floorId));
    this.viewport.approach(place, APPROACH_RANGES * this.loaded.plan.scanner.range_max_m);
  }

  dispose(): void {
    for (const end of this.endings) end();
    this.cloud?.dispose();
    this.marks.dispose();
    this.patchPaint.dispose();
    this.pointer.dispose();
    this.links.dispose();
    this.building.dispose();
    this.viewport.dispose();
  }

  private followTheme(): void {
    const dark = window.matchMedia('(prefers-color-scheme: dark)');
    const apply = (): void => {
      const palette = dark.matches ? DARK : LIGHT;
      this.store.isDark.value = palette.isDark;
      this.building.setPalette(palette);
      this.patchPaint.setPalette(palette);
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
        this.building.setPicked(pickedElement.value);
        this.building.setFaded(store.cloud.value.kind === 'shown' && store.marking.value.kind !== 'shown');
        this.cloud?.setPaint(store.cloudPaint.value);
        const station = store.shownStations.value.find(({ id }) => id === store.stationId.value);
        if (station !== undefined) this.cloud?.setSlice(sliceOfFloor(store.slices.value, station.floorId));
        this.viewport.requestFrame();
      }),
    );
  }

  /** All links that count, those of the chosen station, or the chosen pair's, whether it counts or not. */
  private followLinks(): void {
    const { store } = this;
    const counting = countingOf(this.loaded.plan);
    const shown = computed<LinksShown>(() => {
      const [pair, stationId] = [store.pair.value, store.stationId.value];
      const isOf = (link: PlanLink, id: string): boolean => link.a === id || link.b === id;
      const chosen = store.shownLinks.value.find((link) => pair?.every((id) => isOf(link, id))) ?? null;
      const isAll = store.showLinks.value || (store.tab.value === 'network' && stationId === null);
      const links = store.shownLinks.value.filter(
        (link) => link === chosen || (counts(link, counting) && (isAll || isOf(link, stationId ?? ''))),
      );
      return { stations: store.shownStations.value, links, chosen, isDark: store.isDark.value };
    });
    this.endings.push(
      effect(() => {
        this.links.update(store.slices.value, shown.value);
        this.viewport.requestFrame();
      }),
      effect(() => {
        const pair = store.pair.value;
        if (pair !== null) untracked(() => this.flyToPair(pair));
      }),
    );
  }

  private followStation(): void {
    let fetching = new AbortController();
    const chosen = computed(() => this.store.stationId.value);
    this.endings.push(
      () => fetching.abort(),
      effect(() => {
        const id = chosen.value;
        fetching.abort();
        fetching = new AbortController();
        untracked(() => {
          this.dropCloud();
          const station = this.store.shownStations.value.find((one) => one.id === id);
          if (station !== undefined) this.flyToStation(station);
          const scanned = this.loaded.stage.stations.find((one) => one.id === id);
          if (scanned !== undefined) void this.showCloud(scanned, fetching.signal);
        });
      }),
    );
  }

  private followUnseen(): void {
    this.endings.push(
      effect(() => {
        const focus = this.store.unseenFocus.value;
        if (focus !== null) untracked(() => this.flyToPiece(focus));
      }),
    );
  }

  private flyToPiece({ surface, piece }: UnseenFocus): void {
    const shown = surface.pieces[piece];
    const place = shown && this.places.placeOf(shown.patch);
    if (!place) return;
    const sizeM = Math.hypot(...[0, 1, 2].map((k) => shown.box[1][k] - shown.box[0][k]));
    const liftM = this.liftOf(surface.floor);
    const freeLength = (ray: Ray): number => this.freeLength(ray, liftM);
    const view = viewOf(place.pointM, place.normal, sizeM, freeLength);
    for (const point of [view.position, view.target]) point.z += liftM;
    this.viewport.flyTo(view);
  }

  /**
   * How far nothing is met from a surface on. Its near surroundings count as they are: a cut takes away what tells the
   * front of a surface from its back. Further off only what is drawn hides it.
   */
  private freeLength(ray: Ray, liftM: number): number {
    const nearM = this.picker.firstHit(ray, [WHOLE_BUILDING], NEAR_SURFACE_M)?.distanceM;
    if (nearM !== undefined) return nearM;
    const drawn = new Ray(ray.origin.clone().setZ(ray.origin.z + liftM), ray.direction);
    return this.picker.firstHit(drawn, this.store.slices.peek())?.distanceM ?? Number.POSITIVE_INFINITY;
  }

  /** Where patches are; made when first asked for. */
  private get places(): PatchPlaces {
    this.patchPlaces ??= new PatchPlaces(this.loaded.stage.triangles);
    return this.patchPlaces;
  }

  /** The address says where the camera was left by hand; the choice of a floor or station overrules it. */
  private followCamera(): void {
    const { camera } = this.store;
    this.viewport.onMovedByHand = (pose) => {
      camera.value = pose;
    };
    this.viewport.onFlight = () => {
      camera.value = null;
    };
    const asked = camera.peek();
    if (asked !== null) this.viewport.place(asked);
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
      const cloud = await fetchCloud(this.loaded.base, station, signal);
      if (signal.aborted) return;
      this.cloud = new CloudPoints(cloud, station, this.loaded.plan.scanner.range_max_m);
      this.viewport.scene.add(this.cloud.points);
      this.store.cloud.value = { kind: 'shown', nReturns: cloud.nReturns };
    } catch (error) {
      if (!signal.aborted) this.store.cloud.value = { kind: 'failed', message: (error as Error).message };
    }
  }

  private flyToStation(station: ShownStation): void {
    const place = this.drawnPlace(station);
    if (place !== null) this.viewport.approach(place, APPROACH_RANGES * this.loaded.plan.scanner.range_max_m);
  }

  /** Both stations in the picture, and what is around them. */
  private flyToPair(pair: Pair): void {
    const places = this.store.shownStations
      .peek()
      .filter(({ id }) => pair.includes(id))
      .map((station) => this.drawnPlace(station))
      .filter((place) => place !== null);
    if (places.length !== 2) return;
    const apartM = places[0].distanceTo(places[1]);
    this.viewport.approach(places[0].clone().lerp(places[1], 0.5), Math.max(10, 3.5 * apartM));
  }

  private drawnPlace(station: ShownStation): Vector3 | null {
    const slice = sliceOfFloor(this.store.slices.peek(), station.floorId);
    if (slice === undefined) return null;
    const [x, y, z] = station.positionM;
    return new Vector3(x, y, z + slice.liftM);
  }

  private markerPlaces(): Map<string, MarkerPlace> {
    const places = new Map<string, MarkerPlace>();
    for (const station of this.store.shownStations.peek()) {
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

  /** A click on ground picks its floor; on anything else it tells what that is; beside the building it lets go. */
  private click(clientX: number, clientY: number): void {
    const picked = this.surfaceAt(clientX, clientY);
    if (picked === null) {
      this.store.pick(null);
      return;
    }
    if (picked.groundOf !== null && picked.groundOf !== this.store.floorId.value) {
      this.store.chooseFloor(picked.groundOf);
    }
    this.store.pick(picked);
  }

  private describe(hit: SurfaceHit, beam: Vector3): Picked {
    const { triangles, elements, floors, offsetM } = this.loaded.stage;
    const elementIndex = triangles.element[hit.triangle];
    const patch = patchAt(triangles, hit);
    const seen = this.patchPaint.timesSeen[patch];
    const outward = new Vector3(...normalOf(triangles.cornersM, hit.triangle));
    const isSection = this.loaded.edges.bodySide[hit.triangle] * outward.dot(beam) > 0;
    return {
      element: elements[elementIndex],
      elementIndex,
      triangle: hit.triangle,
      patch,
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
