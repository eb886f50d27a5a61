/** The 3D side of the viewer: follows the store's signals, and tells it what was clicked. */
import { computed, effect, untracked } from '@preact/signals';
import { type Object3D, Ray, Vector3 } from 'three';
import { hiddenTriangles } from '../files/state.ts';
import { sliceOfFloor } from '../floors/cut.ts';
import { coverageOf, type ElementCoverage } from '../heat/element-coverage.ts';
import { NOT_ACHIEVABLE, NOT_ASKED, type PatchValues, TIMES_SEEN, valuesOf } from '../heat/layers.ts';
import { MarkFollower } from '../heat/mark-follower.ts';
import { PatchPaint } from '../heat/patch-paint.ts';
import { quantity } from '../heat/quantity.ts';
import { normalOf } from '../load/edges.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { patchCode } from '../load/patch-rule.ts';
import type { PlanLink } from '../load/plan-json.ts';
import type { StageTriangles } from '../load/stage.ts';
import { countingOf, counts } from '../network/graph.ts';
import { segmentsOf } from '../route/route.ts';
import { RouteLine } from '../route/route-line.ts';
import { CloudSet } from '../stations/cloud-set.ts';
import { LinkLines, type LinksShown } from '../stations/link-lines.ts';
import type { Direction } from '../stations/panorama-image.ts';
import type { Store } from '../store.ts';
import { WalkMode } from '../walk/walk-mode.ts';
import { walkWorld } from '../walk/walk-world.ts';
import { DEFAULT_EYE_HEIGHT_M } from '../walk/walker.ts';
import { Building } from './building.ts';
import { drawnPlace, Flights } from './flights.ts';
import type { MarkerPlace } from './marker-place.ts';
import { DARK, LIGHT } from './palette.ts';
import { PatchPlaces } from './patch-places.ts';
import { type IsPassed, type SurfaceHit, SurfacePicker } from './pick.ts';
import { Pointer, type PointerConsumer } from './pointer.ts';
import type { Picked } from './state.ts';
import { Viewport } from './viewport.ts';
import { weightsAt } from './weights.ts';

/** Nothing this near to a station hides it: it may stand against a table it was planned beside. */
const OCCLUSION_SLACK_M = 0.15;

export class PlanView {
  /** Called after each frame with the places of the markers by station id. */
  onMarkers: (places: ReadonlyMap<string, MarkerPlace>) => void = () => undefined;
  /** What the pointer does on the canvas and on markers. */
  readonly pointer: Pointer;
  readonly walk: WalkMode;
  private readonly viewport: Viewport;
  private readonly building: Building;
  private readonly patchPaint: PatchPaint;
  private readonly marks: MarkFollower;
  private readonly picker: SurfacePicker;
  private readonly isHidden: IsPassed;
  private patchPlaces: PatchPlaces | null = null;
  private readonly links: LinkLines;
  private readonly clouds: CloudSet;
  private readonly route: RouteLine;
  private readonly flights: Flights;
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
    this.picker = new SurfacePicker(loaded.stage.triangles.cornersM, loaded.tree);
    this.isHidden = hiddenTriangles(store, loaded.stage);
    this.marks = new MarkFollower(
      store,
      loaded,
      this.building,
      this.patchPaint,
      () => this.places,
      () => this.requestFrame(),
    );
    this.links = new LinkLines();
    this.clouds = new CloudSet(store, loaded, () => this.requestFrame());
    this.route = new RouteLine();
    this.walk = new WalkMode(store, {
      world: walkWorld(this.picker, loaded.stage),
      pointer: this.pointer,
      groundAt: (x, y) => this.groundAt(x, y),
      place: (pose) => this.viewport.place(pose),
      holdCamera: (isHeld) => this.viewport.holdCamera(isHeld),
      pick: (x, y) => this.store.pick(this.surfaceAt(x, y)),
      left: () => this.showAll('side'),
    });
    this.viewport.scene.add(this.building.group, this.clouds.group, this.links.group, this.route.group);
    this.viewport.onFrame = () => this.onMarkers(this.markerPlaces());
    this.viewport.onResize = (width, height) => {
      this.links.setResolution(width, height);
      this.route.setResolution(width, height);
    };
    this.followTheme();
    this.followFloors();
    this.followLook();
    this.followLinks();
    this.followRoute();
    this.followWalk();
    this.flights = new Flights({
      store,
      loaded,
      viewport: this.viewport,
      picker: this.picker,
      isHidden: this.isHidden,
      places: () => this.places,
      walkAt: (pose) => this.walk.enterAt(pose),
    });
  }

  /** Show everything that is drawn. */
  showAll(from: 'side' | 'top'): void {
    this.flights.showAll(from);
  }

  /** Turn the building counterclockwise and tilt it down, by angles; `closer`: the share of the distance that is left. */
  orbit(turnRad: number, tiltRad: number, closer = 1): void {
    this.viewport.orbit(turnRad, tiltRad, closer);
  }

  /** Copy what is drawn now into another canvas. */
  copyPicture(into: HTMLCanvasElement): void {
    this.viewport.copyPicture(into);
  }

  /** Which way the camera looks, counterclockwise from +x. */
  heading(): number {
    return this.viewport.heading();
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

  /** Look from a station's sensor in a direction. */
  lookFrom(stationId: string, direction: Direction): void {
    this.flights.lookFrom(stationId, direction);
  }

  /** Stand where a station stands, the eye at its sensor. */
  standAt(stationId: string): void {
    const station = this.store.shownStations.peek().find(({ id }) => id === stationId);
    const planned = this.loaded.plan.stations.find(({ id }) => id === stationId);
    if (station === undefined) return;
    const ahead = this.viewport.heading();
    this.walk.enter(station.positionM, ahead, planned?.instrument_height_m ?? undefined);
  }

  /** Walk from the chosen station, from ground that was clicked, or from the station nearest to what is looked at. */
  startWalk(): void {
    const { picked, stationId, shownStations } = this.store;
    const { offsetM } = this.loaded.stage;
    const at = picked.peek();
    if (at !== null && at.groundOf !== null) {
      const [x, y, z] = at.pointM.map((value, k) => value - offsetM[k]);
      this.walk.enter([x, y, z + DEFAULT_EYE_HEIGHT_M], this.viewport.heading());
      return;
    }
    const shown = shownStations.peek().flatMap((station) => {
      const place = drawnPlace(this.store, station);
      return place === null ? [] : [{ id: station.id, farM: place.distanceTo(this.viewport.target()) }];
    });
    const nearest = shown.sort((a, b) => a.farM - b.farM)[0];
    const from = stationId.peek() ?? nearest?.id;
    if (from !== undefined) this.standAt(from);
  }

  /** What the shown layer says of a patch; null: nothing. */
  layerAt(patch: number): { readonly title: string; readonly words: string } | null {
    const found = this.patchPaint.valueAt(patch);
    // How many stations see it stands above it anyway.
    if (found === null || valuesOf(found.layer) === TIMES_SEEN) return null;
    const { layer, value } = found;
    if (layer.kind === 'ramp') return { title: layer.title, words: quantity(value * layer.step, layer.unit) };
    const name = layer.classes.find((one) => one.value === value)?.label;
    return name === undefined ? null : { title: layer.title, words: name };
  }

  /** How much of an element is seen. */
  coverageOf(elementIndex: number): ElementCoverage {
    const { elements, triangles } = this.loaded.stage;
    return coverageOf(elements[elementIndex], triangles, this.patchPaint.timesSeen, this.patchPaint.areas);
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
    const hit = this.firstDrawn(ray);
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

  /** Draw a share of the pixels across and down, 1 for all. */
  setDetail(share: number): void {
    this.viewport.setDetail(share);
  }

  /** Come near to a point (local, not lifted) of a floor. */
  approach([x, y, z]: readonly [number, number, number], floorId: string): void {
    this.flights.approach(new Vector3(x, y, z + this.liftOf(floorId)));
  }

  dispose(): void {
    this.flights.dispose();
    for (const end of this.endings) end();
    this.walk.dispose();
    this.clouds.dispose();
    this.route.dispose();
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
    this.endings.push(
      effect(() => {
        this.building.setSlices(this.store.slices.value, this.store.hiddenFiles.value);
        this.viewport.requestFrame();
      }),
    );
  }

  private followLook(): void {
    const { store } = this;
    const pickedElement = computed(() => highlighted(store.picked.value));
    this.endings.push(
      effect(() => {
        this.building.setPicked(pickedElement.value);
        this.clouds.group.visible = store.marking.value.kind !== 'shown';
        this.building.setFaded(store.cloud.value.kind === 'shown' && store.marking.value.kind !== 'shown');
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
    );
  }

  private followRoute(): void {
    const { store } = this;
    const segments = computed(() => {
      const route = store.shownRoute.value;
      const { offsetM, floors } = this.loaded.stage;
      return route === null ? [] : segmentsOf(route, offsetM, floors);
    });
    this.endings.push(
      effect(() => {
        const route = store.showRoute.value ? store.shownRoute.value : null;
        const leg = route?.legs.findIndex(({ to }) => to === store.stationId.value) ?? -1;
        this.route.update(
          route === null ? [] : segments.value,
          store.slices.value,
          leg < 0 ? null : leg,
          store.isDark.value,
        );
        this.requestFrame();
      }),
    );
  }

  /** A choice that shows something else ends the walk. */
  private followWalk(): void {
    const { store } = this;
    let isFirst = true;
    this.endings.push(
      effect(() => {
        for (const choice of [store.floorId, store.stationId, store.pair, store.unseenFocus]) choice.value;
        if (!isFirst) untracked(() => this.walk.end());
        isFirst = false;
      }),
      effect(() => this.viewport.setWide(store.isWalking.value)),
    );
  }

  /** What one can stand on under a place of the page. */
  private groundAt(clientX: number, clientY: number): [number, number, number] | null {
    const hit = this.firstDrawn(this.viewport.rayAt(clientX, clientY));
    if (hit === null) return null;
    const [nx, ny, nz] = normalOf(this.loaded.stage.triangles.cornersM, hit.triangle);
    const isLevel = Math.abs(nz) > 0.8 * Math.hypot(nx, ny, nz);
    return isLevel ? [hit.pointM.x, hit.pointM.y, hit.pointM.z] : null;
  }

  /** Where patches are; made when first asked for. */
  private get places(): PatchPlaces {
    this.patchPlaces ??= new PatchPlaces(this.loaded.stage.triangles);
    return this.patchPlaces;
  }

  private markerPlaces(): Map<string, MarkerPlace> {
    const places = new Map<string, MarkerPlace>();
    for (const station of this.store.shownStations.peek()) {
      const at = drawnPlace(this.store, station);
      const place = at && this.viewport.project(at);
      const cover = at && this.coverOf(at);
      if (cover && this.store.isWalking.peek()) continue;
      if (!place) continue;
      const coverId = cover?.slice.floorId ?? null;
      const coveredBy = coverId === station.floorId ? null : coverId;
      places.set(station.id, { ...place, isHidden: cover !== null, coveredBy });
    }
    return places;
  }

  /** The surface between the camera and a place; null: none. */
  private coverOf(at: Vector3): SurfaceHit | null {
    const eye = this.viewport.camera.position;
    const ray = new Ray(eye.clone(), at.clone().sub(eye).normalize());
    return this.firstDrawn(ray, eye.distanceTo(at) - OCCLUSION_SLACK_M);
  }

  /** The first surface that a ray meets of what is drawn. */
  private firstDrawn(ray: Ray, farM = Number.POSITIVE_INFINITY): SurfaceHit | null {
    return this.picker.firstHit(ray, this.store.slices.peek(), farM, this.isHidden);
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
      timesSeen: seen === NOT_ACHIEVABLE || seen === NOT_ASKED || isSection ? null : seen,
      isAsked: seen !== NOT_ASKED,
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
