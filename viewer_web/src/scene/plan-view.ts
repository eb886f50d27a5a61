/** The 3D side of the viewer: follows the store's signals, and tells it what was clicked. */
import { batch, computed, effect, untracked } from '@preact/signals';
import { type Object3D, type Ray, Vector3 } from 'three';
import { boxOfElement } from '../elements/search.ts';
import { hiddenTriangles } from '../files/state.ts';
import { sliceOfFloor, WHOLE_BUILDING } from '../floors/cut.ts';
import { coverageOf, type ElementCoverage } from '../heat/element-coverage.ts';
import { isHatched } from '../heat/hatching.ts';
import { type PatchValues, TIMES_SEEN, valuesOf } from '../heat/layers.ts';
import { MarkFollower } from '../heat/mark-follower.ts';
import { PatchPaint } from '../heat/patch-paint.ts';
import { quantity } from '../heat/quantity.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { countingOf } from '../network/graph.ts';
import { RoomFollower } from '../rooms/room-follower.ts';
import { segmentsOf } from '../route/route.ts';
import { RouteLine } from '../route/route-line.ts';
import { setCut } from '../section/cut-uniforms.ts';
import { SightFollower } from '../sights/sight-follower.ts';
import { CloudDetailFollower } from '../stations/cloud-detail.ts';
import { CloudSet } from '../stations/cloud-set.ts';
import { LinkLines, linksShown } from '../stations/link-lines.ts';
import type { Direction } from '../stations/panorama-image.ts';
import type { Store } from '../store.ts';
import { WalkMode } from '../walk/walk-mode.ts';
import { walkWorld } from '../walk/walk-world.ts';
import { DEFAULT_EYE_HEIGHT_M } from '../walk/walker.ts';
import { Building } from './building.ts';
import type { Whence } from './camera.ts';
import { DrawnSurfaces } from './drawn-surfaces.ts';
import { drawnPlace, Flights } from './flights.ts';
import type { MarkerPlace } from './marker-place.ts';
import { DARK, LIGHT } from './palette.ts';
import { PatchPlaces } from './patch-places.ts';
import { type IsPassed, type SurfaceHit, SurfacePicker } from './pick.ts';
import { Pointer, type PointerConsumer } from './pointer.ts';
import { type Snapped, Snapper } from './snap.ts';
import type { Picked } from './state.ts';
import { Viewport } from './viewport.ts';

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
  private readonly drawn: DrawnSurfaces;
  private patchPlaces: PatchPlaces | null = null;
  private readonly links: LinkLines;
  private readonly clouds: CloudSet;
  private readonly cloudDetail: CloudDetailFollower;
  private readonly route: RouteLine;
  private readonly flights: Flights;
  private readonly sights: SightFollower;
  private readonly rooms: RoomFollower;
  private readonly snapper: Snapper;
  private readonly frameListeners = new Set<() => void>();
  private readonly endings: (() => void)[] = [];

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
  ) {
    this.pointer = new Pointer(
      canvas,
      (x, y) => this.click(x, y),
      (isTaken) => this.viewport.holdCamera(isTaken),
    );
    this.viewport = new Viewport(canvas, (hasPicture) => {
      store.hasPicture.value = hasPicture;
    });
    this.building = new Building(loaded);
    this.patchPaint = new PatchPaint(store, loaded, this.building, () => this.requestFrame());
    this.picker = new SurfacePicker(loaded.stage.triangles.cornersM, loaded.tree);
    const isOfHiddenFile = hiddenTriangles(store, loaded.stage);
    this.isHidden = (triangle) =>
      isOfHiddenFile(triangle) ||
      (store.isolation.peek() !== 'none' &&
        loaded.stage.triangles.element[triangle] !== store.picked.peek()?.elementIndex);
    this.drawn = new DrawnSurfaces(store, loaded, this.viewport, this.picker, this.isHidden, this.patchPaint);
    this.snapper = new Snapper(this.picker, loaded, this.isHidden);
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
    this.cloudDetail = new CloudDetailFollower(
      store,
      loaded,
      {
        pose: () => this.viewport.pose().join(),
        places: () => this.drawn.placesInSight(),
        target: () => this.viewport.target().toArray(),
      },
      () => this.requestFrame(),
    );
    this.route = new RouteLine();
    this.walk = new WalkMode(store, {
      world: walkWorld(this.picker, loaded.stage),
      pointer: this.pointer,
      groundAt: (x, y) => this.drawn.groundAt(x, y),
      place: (pose) => this.viewport.place(pose),
      holdCamera: (isHeld) => this.viewport.holdCamera(isHeld),
      pick: (x, y) => this.store.pick(this.surfaceAt(x, y)),
      left: () => this.showAll('side'),
    });
    this.viewport.scene.add(
      this.building.group,
      this.clouds.group,
      this.cloudDetail.group,
      this.links.group,
      this.route.group,
    );
    this.viewport.onFrame = () => {
      this.onMarkers(this.markerPlaces());
      this.cloudDetail.onFrame();
      for (const listener of this.frameListeners) listener();
    };
    this.viewport.onResize = (width, height) => {
      this.links.setResolution(width, height);
      this.route.setResolution(width, height);
    };
    this.followTheme();
    this.followPicture();
    this.followFloors();
    this.followLook();
    this.followLinks();
    this.followRoute();
    this.followWalk();
    this.sights = new SightFollower(store, loaded);
    this.rooms = new RoomFollower(store, loaded, this.patchPaint, this.picker);
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

  /** Show everything that is drawn, with perspective. */
  showAll(from: Whence): void {
    batch(() => {
      this.store.isPlanView.value = false;
      this.store.isFacing.value = false;
    });
    this.flights.showAll(from);
  }

  /** Show everything that is drawn straight from above, without perspective. */
  showPlan(): void {
    batch(() => {
      this.store.isPlanView.value = true;
      this.store.isFacing.value = false;
    });
    this.flights.showAll('top');
  }

  /** Turn the building counterclockwise and tilt it down, by angles; `closer`: the share of the distance that is left. */
  orbit(turnRad: number, tiltRad: number, closer = 1): void {
    const isFlat = this.store.isPlanView.peek() || this.store.isFacing.peek();
    if (!isFlat || closer !== 1) this.viewport.orbit(isFlat ? 0 : turnRad, isFlat ? 0 : tiltRad, closer);
  }

  /** Copy what is drawn now into another canvas. */
  copyPicture(into: HTMLCanvasElement): void {
    this.viewport.copyPicture(into);
  }

  /** Where the camera is, and what it looks at: local metres. */
  pose(): readonly number[] {
    return this.viewport.pose();
  }

  /** Which way the camera looks, counterclockwise from +x. */
  heading(): number {
    return this.viewport.heading();
  }

  /** Called after each frame, for what lies over the canvas. Returns what ends that. */
  onFrame(listener: () => void): () => void {
    this.frameListeners.add(listener);
    this.requestFrame();
    return () => this.frameListeners.delete(listener);
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

  /** Paint what a change loses and wins over the layer; null: nothing. */
  showChange(change: { readonly lost: readonly number[]; readonly won: readonly number[] } | null): void {
    this.building.setChanges(change);
    this.requestFrame();
  }

  /** Look from a station's sensor in a direction, where there is a picture. */
  lookFrom(stationId: string, direction: Direction): void {
    if (this.store.hasPicture.peek()) this.flights.lookFrom(stationId, direction);
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
    return this.drawn.surfaceAt(clientX, clientY);
  }

  /** Open the floor of an element, look at it, and choose it. */
  showElement(elementIndex: number): void {
    const { store, loaded } = this;
    const element = loaded.stage.elements[elementIndex];
    const floor = loaded.stage.floors.find(({ id }) => id === element.floorId);
    store.showFile(element.file, true);
    store.chooseFloor(floor?.id ?? null);
    this.flights.frame(boxOfElement(element, loaded.stage.triangles), element.floorId, true);
    store.pick(this.drawn.surfaceOf(elementIndex));
  }

  /** The corner, edge or surface under a place of the page, a corner or an edge where one is near; null: nothing is. */
  snapAt(clientX: number, clientY: number): Snapped | null {
    return this.snapper.snapAt(clientX, clientY, this.viewport, this.store.slices.peek());
  }

  /** The first surface of the whole building, hidden or not, that a ray meets; local frame. */
  firstOfBuilding(ray: Ray, farM: number): SurfaceHit | null {
    return this.picker.firstHit(ray, [WHOLE_BUILDING], farM);
  }

  /** Keys go to the building from now on. */
  focus(): void {
    this.canvas.focus({ preventScroll: true });
  }

  /** Where the canvas is on the page. */
  get box(): DOMRect {
    return this.canvas.getBoundingClientRect();
  }

  /** Metres that a CSS pixel is wide at what is looked at; in plan view everywhere. */
  metresPerPixel(): number {
    return this.viewport.metresPerPixel();
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

  /** Show all of some places (local, not lifted) of a floor, beside the card that opens with them. */
  frame(places: readonly (readonly [number, number, number])[], floorId: string): void {
    this.flights.frame(places, floorId, true);
  }

  dispose(): void {
    this.flights.dispose();
    this.sights.dispose();
    this.rooms.dispose();
    for (const end of this.endings) end();
    this.walk.dispose();
    this.clouds.dispose();
    this.cloudDetail.dispose();
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

  /** Without a picture there is the plan view alone; with it again, the one before. */
  private followPicture(): void {
    const { store } = this;
    let wasPlanView: boolean | null = null;
    this.endings.push(
      effect(() => {
        const [hasPicture, isPlanView] = [store.hasPicture.value, store.isPlanView.value];
        untracked(() => {
          if (!hasPicture) {
            wasPlanView ??= isPlanView;
            store.isPlanView.value = true;
            this.walk.leave();
          } else if (wasPlanView !== null) {
            store.isPlanView.value = wasPlanView;
            wasPlanView = null;
          }
        });
      }),
    );
  }

  private followFloors(): void {
    this.endings.push(
      effect(() => {
        this.building.setSlices(this.store.wholeSlices.value, this.store.hiddenFiles.value);
        this.viewport.requestFrame();
      }),
      effect(() => {
        setCut(this.building.cut, this.store.slices.value[0]?.planes ?? []);
        this.viewport.requestFrame();
      }),
    );
  }

  private followLook(): void {
    const { store } = this;
    this.endings.push(
      effect(() => {
        // Whoever lets go of the element wants the building back.
        if (store.picked.value === null) store.isolation.value = 'none';
      }),
    );
    const pickedElement = computed(() => highlighted(store.picked.value));
    this.endings.push(
      effect(() => {
        this.building.setPicked(pickedElement.value);
        this.building.setHatched(isHatched.value);
        const alone = store.isolation.value === 'none' ? null : (store.picked.value?.elementIndex ?? null);
        this.building.setIsolated(alone, store.isolation.value === 'xray');
        this.clouds.group.visible = store.marking.value.kind !== 'shown';
        this.building.setFaded(store.cloud.value.kind === 'shown' && store.marking.value.kind !== 'shown');
        this.viewport.requestFrame();
      }),
    );
  }

  private followLinks(): void {
    const { store } = this;
    const counting = countingOf(this.loaded.plan);
    const shown = computed(() => linksShown(store, counting));
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
        for (const choice of [store.floorId, store.stationId, store.pair, store.unseenFocus, store.roomNumber])
          choice.value;
        if (!isFirst) untracked(() => this.walk.end());
        isFirst = false;
      }),
      effect(() => this.viewport.setWide(store.isWalking.value)),
      effect(() => {
        const isFacing = store.isFacing.value && store.sectionLine.value !== null && store.hasPicture.value;
        const flat = isFacing ? 'facing' : store.isPlanView.value ? 'plan' : 'perspective';
        this.viewport.setProjection(store.isWalking.value ? 'perspective' : flat);
      }),
    );
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
      const cover = at && this.drawn.coverOf(at);
      if (cover && this.store.isWalking.peek()) continue;
      if (!place) continue;
      const coverId = cover?.slice.floorId ?? null;
      const coveredBy = coverId === station.floorId ? null : coverId;
      // In a plan the roof is no reason to show a number dimmed.
      places.set(station.id, { ...place, isHidden: cover !== null && this.store.hasPicture.peek(), coveredBy });
    }
    return places;
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
}

/** Ground keeps its colours: it fills the picture, and its coverage is what is looked at. */
function highlighted(picked: Picked | null): number | null {
  return picked === null || picked.groundOf !== null ? null : picked.elementIndex;
}
