/** Where the camera goes: to all that is shown, to what is chosen, and where the address says that it was left by hand. */
import { batch, computed, effect, untracked } from '@preact/signals';
import { Ray, Vector3 } from 'three';
import { extentOf, sliceOfFloor, WHOLE_BUILDING } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { Pair } from '../network/state.ts';
import { facingOf, isKept } from '../section/planes.ts';
import type { Direction } from '../stations/panorama-image.ts';
import type { ShownStation } from '../stations/shown.ts';
import type { Store } from '../store.ts';
import type { UnseenFocus } from '../unseen/state.ts';
import { type Covered, NOTHING_COVERED, type Whence } from './camera.ts';
import type { PatchPlaces } from './patch-places.ts';
import type { IsPassed, SurfacePicker } from './pick.ts';
import { partsOf } from './piece-parts.ts';
import { viewOf } from './viewpoint.ts';
import type { Viewport } from './viewport.ts';

/** The camera comes this near to a station, in ranges of the scanner. */
const APPROACH_RANGES = 3;
/** As style.css has them, with the room around them. */
const [BAR_PX, CARD_PX, LEGEND_PX, NARROW_PX] = [64, 296, 90, 700];
/** As style.css has it: narrower ones have the panel below the picture. */
const NARROW_WINDOW_PX = 820;
/** Of what is around a part, this much is in the picture with it. */
const AROUND_M = 1;
/** In solids and behind panels nothing is free for this long. */
const NEAR_SURFACE_M = 0.5;

export interface FlightDeck {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly viewport: Viewport;
  readonly picker: SurfacePicker;
  /** Whether a triangle is of a file that is switched off. */
  readonly isHidden: IsPassed;
  /** Where patches are; made when first asked for. */
  places(): PatchPlaces;
  /** Walk from where the camera is asked to be. */
  walkAt(pose: readonly number[]): void;
}

export class Flights {
  private readonly endings: (() => void)[] = [];

  constructor(private readonly deck: FlightDeck) {
    this.followFloors();
    this.followPair();
    this.followStation();
    this.followUnseen();
    this.followRoom();
    this.followCamera();
    this.followSection();
  }

  dispose(): void {
    for (const end of this.endings) end();
  }

  /** Show everything that is drawn. */
  showAll(from: Whence, isInstant = false): void {
    const { slices, extents } = this.deck.store;
    const boxes = extents.peek();
    if (boxes === null) return;
    const drawn = extentOf(slices.peek(), boxes.whole, boxes.grounds);
    const { viewport } = this.deck;
    const picture = viewport.box();
    const covered = isNarrow(picture) ? coveredBy(picture, false) : NOTHING_COVERED;
    viewport.showAll(this.deck.store.sectionBox.peek() ?? drawn, from, covered, isInstant);
  }

  /** Look from a station's sensor in a direction. */
  lookFrom(stationId: string, { azimuthRad, elevationRad }: Direction): void {
    const station = this.deck.store.shownStations.peek().find(({ id }) => id === stationId);
    const position = station && drawnPlace(this.deck.store, station);
    if (!position) return;
    this.endFlat();
    const flat = Math.cos(elevationRad);
    const ahead = new Vector3(flat * Math.cos(azimuthRad), flat * Math.sin(azimuthRad), Math.sin(elevationRad));
    this.deck.viewport.flyTo({ position, target: position.clone().add(ahead) });
  }

  /** Show all of some places (local, not lifted) of a floor, from beside or, in plan view, from above. */
  frame(places: readonly (readonly [number, number, number])[], floorId: string, hasCard: boolean): void {
    const { store, viewport } = this.deck;
    const liftM = sliceOfFloor(store.slices.peek(), floorId)?.liftM ?? 0;
    const ends = (of: (...values: number[]) => number, aroundM: number) =>
      [0, 1, 2].map((k) => of(...places.map((place) => place[k])) + (k < 2 ? aroundM : liftM)) as [
        number,
        number,
        number,
      ];
    const part = { minM: ends(Math.min, -AROUND_M), maxM: ends(Math.max, AROUND_M) };
    viewport.showPart(part, store.isPlanView.peek() ? 'top' : 'side', coveredBy(viewport.box(), hasCard));
  }

  /** Come near to a place as it is drawn. */
  approach(place: Vector3): void {
    this.deck.viewport.approach(place, APPROACH_RANGES * this.deck.loaded.plan.scanner.range_max_m);
  }

  /** The choice of floor counts, not the slider of the cut. */
  private followFloors(): void {
    const { store } = this.deck;
    let isFirst = true;
    this.endings.push(
      effect(() => {
        store.floorId.value;
        store.isSpread.value;
        const from = store.isPlanView.peek() ? 'top' : 'side';
        // A section is looked at squarely, see below.
        const isLeft = store.stationId.peek() !== null || store.isFacing.peek();
        if (!isLeft || isFirst) this.showAll(from, isFirst);
        isFirst = false;
      }),
    );
  }

  private followPair(): void {
    this.endings.push(
      effect(() => {
        const pair = this.deck.store.pair.value;
        if (pair !== null) untracked(() => this.flyToPair(pair));
      }),
    );
  }

  private followStation(): void {
    const { store } = this.deck;
    const chosen = computed(() => store.stationId.value);
    this.endings.push(
      effect(() => {
        const id = chosen.value;
        untracked(() => {
          const station = store.shownStations.value.find((one) => one.id === id);
          // While editing the view stays: the next thing is often to drag the station in it.
          if (station !== undefined && store.tab.value !== 'edit') this.flyToStation(station);
        });
      }),
    );
  }

  private followUnseen(): void {
    this.endings.push(
      effect(() => {
        const focus = this.deck.store.unseenFocus.value;
        if (focus !== null) untracked(() => this.flyToPiece(focus));
      }),
    );
  }

  /** All of a room in the picture, from beside or, in plan view, from above. */
  private followRoom(): void {
    const { store, loaded } = this.deck;
    this.endings.push(
      effect(() => {
        const number = store.roomNumber.value;
        const room = number === null ? undefined : loaded.layers?.rooms?.list[number];
        if (room === undefined) return;
        untracked(() => {
          this.frame(room.box, room.floor, false);
        });
      }),
    );
  }

  /** Squarely at the section along a line, and from beside when that ends. */
  private followSection(): void {
    const { store, viewport } = this.deck;
    let wasFacing = false;
    this.endings.push(
      effect(() => {
        const [line, isFacing] = [store.sectionLine.value, store.isFacing.value];
        const whole = store.extents.peek()?.whole;
        if (line !== null && isFacing && whole !== undefined) {
          const { fromM, toM } = line;
          const middle = [fromM[0] + toM[0], fromM[1] + toM[1], whole.minM[2] + whole.maxM[2]].map((x) => x / 2);
          const widthM = Math.hypot(toM[0] - fromM[0], toM[1] - fromM[1]);
          untracked(() => viewport.face(new Vector3(...middle), facingOf(line), widthM, whole.maxM[2] - whole.minM[2]));
        } else if (wasFacing && line !== null && !store.isPlanView.peek())
          untracked(() => viewport.orbit(0.5, -0.5, 1));
        else if (wasFacing) untracked(() => this.showAll(store.isPlanView.value ? 'top' : 'side'));
        wasFacing = line !== null && isFacing;
      }),
    );
  }

  /** The address says where the camera was left by hand; the choice of a floor or station overrules it. */
  private followCamera(): void {
    const { store, viewport } = this.deck;
    const { camera, startsWalking } = store;
    let own: readonly number[] | null = null;
    viewport.onMovedByHand = (pose) => {
      own = pose;
      camera.value = pose;
    };
    viewport.onFlight = () => {
      camera.value = null;
    };
    this.endings.push(
      effect(() => {
        const asked = camera.value;
        if (asked === null || asked === own || store.isWalking.peek()) return;
        if (startsWalking.peek()) this.deck.walkAt(asked);
        else viewport.place(asked);
        startsWalking.value = false;
      }),
    );
  }

  /** Views from anywhere have perspective. */
  private endFlat(): void {
    batch(() => {
      this.deck.store.isPlanView.value = false;
      this.deck.store.isFacing.value = false;
    });
  }

  private flyToStation(station: ShownStation): void {
    const place = drawnPlace(this.deck.store, station);
    if (place !== null) this.approach(place);
  }

  /** Both stations in the picture, and what is around them. */
  private flyToPair(pair: Pair): void {
    const { store, viewport } = this.deck;
    const places = store.shownStations
      .peek()
      .filter(({ id }) => pair.includes(id))
      .map((station) => drawnPlace(store, station))
      .filter((place) => place !== null);
    if (places.length !== 2) return;
    const apartM = places[0].distanceTo(places[1]);
    viewport.approach(places[0].clone().lerp(places[1], 0.5), Math.max(10, 3.5 * apartM));
  }

  private flyToPiece({ surface, piece }: UnseenFocus): void {
    const { store, loaded, viewport } = this.deck;
    const shown = surface.pieces[piece];
    const { stage, edges } = loaded;
    const elementIndex = stage.elements.findIndex(({ sceneIndex }) => sceneIndex === surface.element);
    const parts = shown && partsOf(shown, stage.elements[elementIndex], stage, this.deck.places(), edges.bodySide);
    if (!parts) return;
    const liftM = sliceOfFloor(store.slices.peek(), surface.floor)?.liftM ?? 0;
    const view = viewOf(parts, {
      freeLength: (ray) => this.freeLength(ray, liftM),
      freePastItself: (ray) => this.freeLength(ray, liftM, (t) => stage.triangles.element[t] === elementIndex),
      isOpen: (fromM, toM) => this.isOpen(fromM, toM, liftM),
    });
    for (const point of [view.position, view.target]) point.z += liftM;
    this.endFlat();
    viewport.flyTo(view);
  }

  /**
   * How far nothing is met from a surface on. Its near surroundings count as they are: a cut takes away what tells the
   * front of a surface from its back. Further off only what is drawn hides it.
   */
  private freeLength(ray: Ray, liftM: number, isPassed?: IsPassed): number {
    const { picker, store, isHidden } = this.deck;
    const nearM = picker.firstHit(ray, [WHOLE_BUILDING], NEAR_SURFACE_M, isPassed)?.distanceM;
    if (nearM !== undefined) return nearM;
    const drawn = new Ray(ray.origin.clone().setZ(ray.origin.z + liftM), ray.direction);
    const isBehind: IsPassed = (t) => isHidden(t) || isPassed?.(t) === true;
    const far = picker.firstHit(drawn, store.slices.peek(), Number.POSITIVE_INFINITY, isBehind);
    return far?.distanceM ?? Number.POSITIVE_INFINITY;
  }

  /** Whether nothing that is drawn lies between two places, which are drawn higher by `liftM`. */
  private isOpen(fromM: Vector3, toM: Vector3, liftM: number): boolean {
    const { picker, store, isHidden } = this.deck;
    const from = fromM.clone().setZ(fromM.z + liftM);
    const direction = toM.clone().sub(fromM).normalize();
    return picker.firstHit(new Ray(from, direction), store.slices.peek(), fromM.distanceTo(toM), isHidden) === null;
  }
}

/** Of the bar above the picture, and of the card that opens beside what is shown; on narrow pages both lie below, and the legend is as wide. */
function coveredBy(picture: DOMRect, hasCard: boolean): Covered {
  const { width, height } = picture;
  const heightPx = Math.max(height, 1);
  if (isNarrow(picture)) return { right: 0, top: 0, bottom: LEGEND_PX / heightPx };
  const isBeside = hasCard && width > NARROW_PX;
  return { right: isBeside ? CARD_PX / width : 0, top: BAR_PX / heightPx, bottom: 0 };
}

/** The picture reaches to the right end of the window. */
const isNarrow = ({ right }: DOMRect): boolean => right <= NARROW_WINDOW_PX;

/** Where a station is drawn; null: its floor is not shown, or a section takes it away. */
export function drawnPlace(store: Store, { floorId, positionM }: ShownStation): Vector3 | null {
  const slice = sliceOfFloor(store.slices.peek(), floorId);
  if (slice === undefined) return null;
  const [x, y, z] = positionM;
  return isKept(slice.planes ?? [], positionM) ? new Vector3(x, y, z + slice.liftM) : null;
}
