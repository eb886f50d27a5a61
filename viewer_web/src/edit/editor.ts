/** The editor: everything that changes the review with the pointer, and what it draws. Lives as long as the 3D view. */
import { computed, effect } from '@preact/signals';
import type { ReviewClient } from '../api/review-client.ts';
import { sliceOfFloor } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { Pins } from '../review/pins.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { type Area, AreaOverlay } from './area-overlay.ts';
import { AreaTools } from './area-tools.ts';
import { type Arrow, Arrows } from './arrows.ts';
import { localOf } from './draft.ts';
import { DraftFollower } from './draft-follower.ts';
import { fetchGround, type GroundMap } from './ground-map.ts';
import { GroundOverlay } from './ground-overlay.ts';
import { isLive, toolInHand } from './readiness.ts';
import { floorAt, reviewAreas } from './review-areas.ts';
import { StationMover } from './station-mover.ts';

export class Editor {
  readonly follower: DraftFollower;
  readonly mover: StationMover;
  readonly areas: AreaTools;
  private readonly areaOverlay = new AreaOverlay();
  private readonly arrows = new Arrows();
  private readonly pins = new Pins();
  private groundOverlay: GroundOverlay | null = null;
  private readonly grounds = new Map<string, Promise<GroundMap>>();
  private groundAsked: Promise<GroundMap> | null = null;
  private readonly endings: (() => void)[];
  /** Computed, so that a drag redraws only what it changes. */
  private readonly reviewed = computed(() => this.areasOfReview());
  private readonly picksGround = computed(() => toolInHand(this.store) === 'ground');
  private readonly groundFloor = computed(() => this.floorToHave());
  private readonly showsGround = computed(() => this.isGroundWanted());

  constructor(
    private readonly store: Store,
    private readonly reviewClient: ReviewClient,
    private readonly view: PlanView,
    private readonly loaded: LoadedPlan,
  ) {
    const groundOf = (floorId: string): Promise<GroundMap> => this.groundOf(floorId);
    this.follower = new DraftFollower(store, reviewClient, loaded);
    this.mover = new StationMover(store, reviewClient, view, loaded, this.follower, groundOf);
    this.areas = new AreaTools(store, reviewClient, view, loaded, (floorId, at, groundM) =>
      this.mover.add(floorId, at, groundM),
    );
    this.endings = [
      view.onPointer(this.areas.consumer),
      view.addOverlay(this.areaOverlay.group),
      ...this.arrows.meshes.map((mesh) => view.addOverlay(mesh)),
      effect(() => this.drawAreas()),
      view.addOverlay(this.pins.points),
      effect(() => this.drawArrows()),
      effect(() => this.drawPins()),
      effect(() => this.followGround()),
      effect(() => this.drawGround()),
      () => this.dropGround(),
    ];
  }

  dispose(): void {
    for (const end of this.endings) end();
    this.mover.dispose();
    this.follower.dispose();
    this.areaOverlay.dispose();
    this.arrows.dispose();
    this.pins.dispose();
  }

  /** The ground of a floor as the review leaves it; asked for once for each state of what it keeps free. */
  private groundOf(floorId: string): Promise<GroundMap> {
    const review = this.reviewClient.review.peek();
    const key = `${floorId} ${JSON.stringify([review?.zones, review?.forbidden])}`;
    let ground = this.grounds.get(key);
    if (ground === undefined) {
      ground = fetchGround(this.reviewClient.client, floorId);
      ground.catch(() => this.grounds.delete(key));
      this.grounds.set(key, ground);
    }
    return ground;
  }

  /** While editing, have the ground of the floor at hand before anything is dragged on it. */
  private followGround(): void {
    const { store, reviewClient } = this;
    const floorId = this.groundFloor.value;
    reviewClient.review.value;
    if (floorId === null) return;
    const asked = this.groundOf(floorId);
    this.groundAsked = asked;
    void asked
      .then((ground) => {
        // An answer may be overtaken by that of another floor, or of a newer review.
        if (asked === this.groundAsked) store.editing.ground.value = ground;
      })
      .catch((error: Error) => reviewClient.warn(error.message));
  }

  private floorToHave(): string | null {
    const { store } = this;
    if (store.tab.value !== 'edit' || !isLive(store)) return null;
    const underWay = store.editing.underWay.value;
    const station = store.shownStations.value.find(({ id }) => id === store.stationId.value);
    return underWay?.floorId ?? station?.floorId ?? store.floorId.value;
  }

  private isGroundWanted(): boolean {
    const { editing, tab } = this.store;
    return tab.value === 'edit' && (editing.underWay.value !== null || editing.tool.value === 'add');
  }

  /** The ground is tinted while a station is on its way, and while one is to be added. */
  private drawGround(): void {
    const { store, loaded } = this;
    const ground = store.editing.ground.value;
    const floor = loaded.stage.floors.find(({ id }) => id === ground?.floorId);
    const slice = floor && sliceOfFloor(store.slices.value, floor.id);
    this.dropGround();
    if (ground === null || !this.showsGround.value || floor === undefined || slice === undefined) return;
    const overlay = new GroundOverlay(ground, floor.elevationM + slice.liftM, loaded.stage.offsetM);
    const remove = this.view.addOverlay(overlay.mesh);
    this.groundOverlay = overlay;
    this.removeGround = remove;
  }

  private removeGround: () => void = () => undefined;

  private dropGround(): void {
    this.removeGround();
    this.groundOverlay?.dispose();
    this.groundOverlay = null;
    this.removeGround = () => undefined;
  }

  private areasOfReview(): readonly Area[] {
    const { store, reviewClient, loaded } = this;
    const review = reviewClient.review.value;
    const isShown = !store.editing.showsPlan.value && store.planBase.value === OWN_PLAN;
    return review !== null && isShown ? reviewAreas(review, loaded, this.picksGround.value) : [];
  }

  private drawAreas(): void {
    const { store, loaded } = this;
    const { outline, outlineFloor } = store.editing;
    const areas = [...this.reviewed.value];
    const floor = loaded.stage.floors.find(({ id }) => id === outlineFloor.value);
    if (floor !== undefined) {
      const { offsetM } = loaded.stage;
      const inPlan = outline.value.map(([x, y]) => [x - offsetM[0], y - offsetM[1]] as const);
      areas.push({ kind: 'drawing', floorId: floor.id, heightM: floor.elevationM, outline: inPlan, isOpen: true });
    }
    const { value: slices } = store.slices;
    this.areaOverlay.set(areas, (floorId) => sliceOfFloor(slices, floorId)?.liftM ?? null);
    this.view.requestFrame();
  }

  private drawArrows(): void {
    const { store, loaded } = this;
    const { value: slices } = store.slices;
    const lifted = (sceneM: readonly [number, number, number], floorId: string): [number, number, number] | null => {
      const slice = sliceOfFloor(slices, floorId);
      if (slice === undefined) return null;
      const [x, y, z] = localOf(sceneM, loaded.stage.offsetM);
      return [x, y, z + slice.liftM];
    };
    const stations = store.editing.showsPlan.value ? [] : this.follower.stations.value;
    const arrows = stations.flatMap((station): Arrow[] => {
      const toM = lifted(station.positionM, station.floorId);
      if (toM === null) return [];
      if (station.isRemoved) return [{ kind: 'gone', atM: toM }];
      const fromM = station.movedFromM && lifted(station.movedFromM, station.floorId);
      return fromM ? [{ kind: 'moved', fromM, toM }] : [];
    });
    this.arrows.set(arrows);
    this.view.requestFrame();
  }

  /** Where comments that are not resolved are pinned to a place; those of stations are told in the list. */
  private drawPins(): void {
    const { store, reviewClient, loaded } = this;
    const { floors, offsetM } = loaded.stage;
    const slices = store.slices.value;
    const isShown = store.tab.value === 'review' && store.planBase.value === OWN_PLAN;
    const comments = isShown ? Object.values(reviewClient.review.value?.comments ?? {}) : [];
    this.pins.set(
      comments.flatMap(({ position_m, resolved }) => {
        if (resolved || position_m === null) return [];
        const [x, y, z] = localOf(position_m, offsetM);
        const slice = sliceOfFloor(slices, floorAt(floors, z));
        return slice === undefined ? [] : [[x, y, z + slice.liftM] as const];
      }),
    );
    this.view.requestFrame();
  }
}
