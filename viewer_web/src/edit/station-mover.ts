/** Moves, raises and adds stations: places while the pointer moves, the server's answer as it comes, and a commit at the end. */

import { batch, effect, untracked } from '@preact/signals';
import type { Change, Point } from '../api/documents.ts';
import type { ReviewClient } from '../api/review-client.ts';
import { type PatchValues, TIMES_SEEN } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { coordinatesWords, counted, lengthWords } from '../panels/figures.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { PointerConsumer, PointerPlace } from '../scene/pointer.ts';
import type { Store } from '../store.ts';
import { addStation, moveStation, type Pose } from './changes.ts';
import { type DraftStation, localOf, sceneOf, usualHeightM } from './draft.ts';
import type { DraftFollower } from './draft-follower.ts';
import { GROUND, type GroundMap, type Place } from './ground-map.ts';
import { joinedPose } from './joined-pose.ts';
import { PreviewLoop } from './preview-loop.ts';
import { askPreview, type Preview, PreviewPaint, type Wish } from './previews.ts';
import { isLive, toolInHand, whyNotLive } from './readiness.ts';
import type { UnderWay } from './state.ts';
import { surfaceChange } from './what-if.ts';

/** What the live side has values of while something moves; others keep the plan's. */
const LIVE_LAYERS = new Set(['times_seen', 'range', 'incidence', 'spacing', 'noise']);

/** Frames that take longer lag behind the pointer; a quarter of the pixels across still shows what is seen. */
const SLOW_FRAME_MS = 70;
/** Where frames are so quick, four times the pixels are not slow either. */
const FAST_FRAME_MS = 15;
const LEAST_DETAIL = 0.25;
/** Nearer to the click than this is where it was meant. */
const NOT_WORTH_TELLING_M = 0.15;
/** Stations that move together keep their distances: none goes to the next best position. */
const SAME_PLACE_M = 0.01;

export class StationMover {
  private readonly paint: PreviewPaint;
  private readonly loop: PreviewLoop<Wish, Preview>;
  private readonly endings: (() => void)[];
  private grabbed: DraftStation | null = null;
  /** Why what was pressed is not dragged, told once it is tried; null: it is. */
  private refusal: string | null = null;
  /** The review when what is under way began: who changed the station since then is told of, not overwritten. */
  private basisRevision = 0;
  /** The station as it was then; null: it is a new one. */
  private basis: DraftStation | null = null;
  /** Where the pointer is with what was grabbed, scene frame; null: it has not moved. */
  private wantedAt: Place | null = null;
  /** Steps of keys that come meanwhile would begin at the old places. */
  private isMovingAll = false;
  private detail = 1;
  /** Rising over reloads of the page too: the server drops questions older than one it has had. */
  private sequence = Date.now();

  constructor(
    private readonly store: Store,
    private readonly reviewClient: ReviewClient,
    private readonly view: PlanView,
    private readonly loaded: LoadedPlan,
    private readonly follower: DraftFollower,
    private readonly groundOf: (floorId: string) => Promise<GroundMap>,
  ) {
    this.paint = new PreviewPaint(view);
    this.loop = new PreviewLoop(
      (wish, signal) => askPreview(reviewClient.client, wish, this.nextSequence(), signal),
      (preview, askedMs) => this.show(preview, askedMs),
      (error) => reviewClient.warn(error.message),
    );
    this.endings = [
      view.onPointer(this.consumer()),
      // New values of all patches are on their way: what is drawn over the old ones goes with them.
      effect(() => {
        this.follower.layers.value;
        this.paint.forget();
      }),
    ];
  }

  dispose(): void {
    this.loop.stop();
    for (const end of this.endings) end();
  }

  /** Show the station at another height, not yet committed. */
  raise(station: DraftStation, heightM: number): void {
    if (this.store.editing.underWay.peek() === null) this.begin(station);
    const [x, y, z] = station.positionM;
    const from = station.instrumentHeightM ?? heightM;
    this.put({ stationId: station.id, floorId: station.floorId, positionM: [x, y, z - from + heightM], heightM });
  }

  /** Commit what is under way, where the server says that it can be; null: nothing was committed. */
  async finish(): Promise<Placed | null> {
    const underWay = this.store.editing.underWay.peek();
    this.grabbed = null;
    if (underWay === null) return null;
    let placed: Placed | null = null;
    this.loop.stop();
    this.store.editing.nDrags.value++;
    try {
      // A lock that was on its way when the pointer came down holds too.
      await this.reviewClient.settled();
      const now = this.follower.stations.peek().find(({ id }) => id === underWay.stationId);
      const words = now === undefined ? null : whyItStays(now);
      if (words !== null) throw new Error(words);
      // The place that was asked for last, and not one on the way there.
      const preview = await askPreview(this.reviewClient.client, this.wish(underWay), this.nextSequence());
      this.show(preview, null);
      placed = await this.commit(underWay, preview);
    } catch (error) {
      this.reviewClient.warn((error as Error).message);
    }
    this.letGo();
    return placed;
  }

  /** Back to where it was. */
  cancel(): void {
    this.grabbed = null;
    this.refusal = null;
    this.loop.stop();
    this.letGo();
  }

  /** A new station at a place on a floor, or as near to it as a tripod can stand; scene frame. */
  async add(floorId: string, at: readonly [number, number], groundM: number): Promise<void> {
    this.begin(null);
    const ground = await this.groundOf(floorId);
    const place = ground.nearestAdmissible(at);
    if (place === null) {
      this.reviewClient.warn(t('No valid tripod position on this floor.'));
      return;
    }
    const heightM = this.usualHeightM(floorId);
    const positionM: Point = [place[0], place[1], groundM + heightM];
    this.store.editing.underWay.value = { stationId: null, floorId, positionM, heightM };
    const added = await this.finish();
    if (added === null) return;
    const [x, y] = added.positionM;
    const awayM = Math.hypot(x - at[0], y - at[1]);
    if (awayM < NOT_WORTH_TELLING_M) return;
    const text = t('No tripod can stand at that point: {id} was added {length} away.', {
      id: added.id,
      length: lengthWords(awayM),
    });
    this.reviewClient.notice.value = { kind: 'note', text };
  }

  /**
   * Another place in steps, as by keys: north is +y. Steps add up until `finish`; the last place that a tripod can stand at
   * stays where a step leads into a wall.
   */
  async nudge(station: DraftStation, eastM: number, northM: number): Promise<void> {
    const { store } = this;
    const words = whyItStays(station);
    if (words !== null || !isLive(store)) {
      this.reviewClient.warn(words ?? whyNotLive(store) ?? '');
      return;
    }
    if (store.editing.underWay.peek() === null) this.begin(station);
    const revision = this.basisRevision;
    const ground = await this.groundOf(station.floorId).catch((error: Error) => this.reviewClient.warn(error.message));
    if (!ground) return;
    const underWay = store.editing.underWay.peek();
    if (revision !== this.basisRevision || (underWay !== null && underWay.stationId !== station.id)) return;
    const [x, y, z] = underWay?.positionM ?? station.positionM;
    const place: Place = [x + eastM, y + northM];
    if (ground.at(place) !== GROUND.admissible) {
      this.reviewClient.warn(t('No tripod can stand further that way.'));
      return;
    }
    const heightM = underWay?.heightM ?? station.instrumentHeightM ?? this.usualHeightM(station.floorId);
    store.editing.ground.value = ground;
    this.put({ stationId: station.id, floorId: station.floorId, positionM: [...place, z], heightM });
  }

  /** To a place that was typed, scene frame: the sensor there, or a word on why no tripod can stand under it. */
  async place(station: DraftStation, [x, y, z]: Point): Promise<void> {
    const words = whyItStays(station) ?? (isLive(this.store) ? null : whyNotLive(this.store));
    if (words !== null) {
      this.reviewClient.warn(words);
      return;
    }
    this.begin(station);
    const ground = await this.groundOf(station.floorId).catch((error: Error) => this.reviewClient.warn(error.message));
    if (!ground || this.store.editing.underWay.peek() !== null) return;
    if (ground.at([x, y]) !== GROUND.admissible) {
      const nearest = ground.nearestAdmissible([x, y]);
      const refusal = t('No tripod can stand at {place}.', { place: coordinatesWords([x, y]) });
      const advice =
        nearest === null ? '' : ` ${t('The nearest position is {place}.', { place: coordinatesWords(nearest) })}`;
      this.reviewClient.warn(`${refusal}${advice}`);
      return;
    }
    const heightM = (station.instrumentHeightM ?? this.usualHeightM(station.floorId)) + z - station.positionM[2];
    this.put({ stationId: station.id, floorId: station.floorId, positionM: [x, y, z], heightM });
    await this.finish();
  }

  /** Several together, as one change: where one can't stand, none is moved. */
  async moveAll(stations: readonly DraftStation[], eastM: number, northM: number): Promise<void> {
    const { reviewClient, store } = this;
    if (eastM === 0 && northM === 0) return;
    const stays = stations.map(whyItStays).find((words) => words !== null);
    const refusal = stays ?? (isLive(store) ? null : whyNotLive(store));
    if (refusal !== null || this.isMovingAll || store.editing.underWay.peek() !== null) {
      if (refusal !== null) reviewClient.warn(refusal);
      return;
    }
    this.begin(null);
    const revision = this.basisRevision;
    this.isMovingAll = true;
    try {
      const changes: Change[] = [];
      for (const { id, floorId, positionM, instrumentHeightM } of stations) {
        const [x, y, z] = positionM;
        const heightM = instrumentHeightM ?? this.usualHeightM(floorId);
        const asked: UnderWay = { stationId: id, floorId, positionM: [x + eastM, y + northM, z], heightM };
        const { head } = await askPreview(reviewClient.client, this.wish(asked), this.nextSequence());
        const besideM = Math.hypot(head.position[0] - x - eastM, head.position[1] - y - northM);
        if (!head.admissible || besideM > SAME_PLACE_M) {
          reviewClient.warn(
            t('No valid tripod position for {id} there: {reason}. Nothing was moved.', { id, reason: head.reason }),
          );
          return;
        }
        const [px, py, pz] = head.position;
        const pose = {
          position_m: [px, py, pz] as const,
          instrument_height_m: head.instrument_height_m,
          floor: floorId,
        };
        changes.push(moveStation(id, pose));
      }
      await reviewClient.settled();
      await reviewClient.commit(
        t('move {stations}', { stations: counted(changes.length, 'station') }),
        changes,
        reviewClient.withOwnSince(revision),
      );
    } catch (error) {
      reviewClient.warn((error as Error).message);
    } finally {
      this.isMovingAll = false;
    }
  }

  private consumer(): PointerConsumer {
    return {
      onDown: (place) => this.grab(place),
      onMove: (place) => this.drag(place),
      onUp: (_, isClick) => {
        if (isClick) this.cancel();
        else void this.drop();
      },
      onCancel: () => this.cancel(),
    };
  }

  private begin(station: DraftStation | null): void {
    this.basis = station;
    this.basisRevision = this.reviewClient.review.peek()?.revision ?? 0;
  }

  private grab({ stationId }: PointerPlace): boolean {
    const { store } = this;
    if (stationId === null || untracked(() => toolInHand(store)) !== 'select' || !isLive(store)) return false;
    if (store.editing.underWay.peek() !== null) return false;
    const station = this.follower.stations.peek().find(({ id }) => id === stationId);
    if (station === undefined) return false;
    this.refusal = whyItStays(station);
    if (this.refusal !== null) return true;
    this.begin(station);
    this.grabbed = station;
    this.wantedAt = null;
    void this.groundOf(station.floorId)
      .then((ground) => {
        if (this.grabbed !== station) return;
        store.editing.ground.value = ground;
        this.follow();
      })
      .catch((error: Error) => this.reviewClient.warn(error.message));
    return true;
  }

  private drag({ clientX, clientY }: PointerPlace): void {
    const { grabbed, loaded, refusal } = this;
    if (refusal !== null) this.reviewClient.warn(refusal);
    this.refusal = null;
    if (grabbed === null) return;
    const { offsetM } = loaded.stage;
    const level = localOf(grabbed.positionM, offsetM)[2];
    const at = this.view.levelAt(clientX, clientY, grabbed.floorId, level);
    if (at === null) return;
    const [x, y] = sceneOf(at, offsetM);
    this.wantedAt = [x, y];
    this.follow();
  }

  /** As near to the pointer as a tripod can stand, as soon as it is known where one can. */
  private follow(): void {
    const { grabbed, wantedAt } = this;
    const ground = this.store.editing.ground.peek();
    if (grabbed === null || wantedAt === null || ground?.floorId !== grabbed.floorId) return;
    const place = ground.nearestAdmissible(wantedAt);
    if (place === null) return;
    this.put({
      stationId: grabbed.id,
      floorId: grabbed.floorId,
      positionM: [place[0], place[1], grabbed.positionM[2]],
      heightM: grabbed.instrumentHeightM ?? this.usualHeightM(grabbed.floorId),
    });
  }

  /** Let go of what was dragged; where the ground is not known yet, it is waited for. */
  private async drop(): Promise<void> {
    const { grabbed } = this;
    if (grabbed !== null && this.store.editing.underWay.peek() === null) {
      // What went wrong was told when it was grabbed.
      await this.groundOf(grabbed.floorId).catch(() => undefined);
      if (this.grabbed !== grabbed) return;
    }
    const underWay = this.store.editing.underWay.peek();
    const together = this.together(grabbed);
    if (underWay === null || grabbed === null || together.length < 2) {
      await this.finish();
      return;
    }
    const [eastM, northM] = [0, 1].map((k) => underWay.positionM[k] - grabbed.positionM[k]);
    this.cancel();
    await this.moveAll(together, eastM, northM);
  }

  /** The selection that a station is one of. */
  private together(station: DraftStation | null): readonly DraftStation[] {
    const ids = this.store.selection.peek();
    if (station === null || !ids.has(station.id)) return [];
    return this.follower.stations.peek().filter(({ id, isRemoved, isFixed }) => ids.has(id) && !isRemoved && !isFixed);
  }

  private put(underWay: UnderWay): void {
    const isFirst = this.store.editing.underWay.peek() === null;
    if (isFirst && this.detail < 1) this.view.setDetail(this.detail);
    this.store.editing.underWay.value = underWay;
    this.view.requestFrame();
    this.loop.put(this.wish(underWay));
  }

  private wish({ stationId, floorId, positionM, heightM }: UnderWay): Wish {
    const shown = this.store.layerId.peek();
    const layerId = LIVE_LAYERS.has(shown) ? shown : 'times_seen';
    return { stationId, floorId, positionM, heightM, layerId };
  }

  private show(preview: Preview, askedMs: number | null): void {
    this.store.editing.preview.value = preview.head;
    const layers = this.follower.layers.peek();
    if (layers !== null) this.paint.show(preview, layers.valuesOf);
    const timesSeen = layers?.valuesOf(TIMES_SEEN);
    if (timesSeen !== undefined) this.showChange(preview, timesSeen);
    if (askedMs === null) return;
    this.store.editing.answerTimes.add(performance.now() - askedMs);
    // The frame that draws it was asked for before this one; when the next one begins, it is on the screen.
    requestAnimationFrame((begun) => {
      requestAnimationFrame(() => {
        this.store.editing.drawTimes.add(performance.now() - askedMs);
        this.adjustDetail(performance.now() - begun);
      });
    });
  }

  /** In figures and in the building, against the draft without the change. */
  private showChange({ delta }: Preview, timesSeen: PatchValues): void {
    const { plan, scope } = this.loaded;
    const before = { timesSeen, areasM2: this.view.patchAreasM2, scope, seenFrom: plan.requirements.seen_from };
    const change = surfaceChange(delta, before);
    this.store.editing.surfaceChange.value = change;
    this.view.showChange(change);
  }

  /**
   * On a machine that draws slowly a picture in time is worth more than a sharp one, until the pointer lets go. What was found
   * out is kept for the next drag.
   */
  private adjustDetail(frameMs: number): void {
    if (this.store.editing.underWay.peek() === null) return;
    if (frameMs > SLOW_FRAME_MS && this.detail > LEAST_DETAIL) this.detail /= 2;
    else if (frameMs < FAST_FRAME_MS && this.detail < 1) this.detail *= 2;
    else return;
    this.view.setDetail(this.detail);
  }

  private async commit({ stationId, floorId }: UnderWay, { head }: Preview): Promise<Placed | null> {
    const { reviewClient, store } = this;
    if (!head.admissible) {
      reviewClient.warn(t('No valid tripod position there: {reason}.', { reason: head.reason }));
      return null;
    }
    const [x, y, z] = head.position;
    const pose = { position_m: [x, y, z] as const, instrument_height_m: head.instrument_height_m, floor: floorId };
    if (stationId !== null) {
      const isMoved = await reviewClient.commit(
        t('move {id}', { id: stationId }),
        [moveStation(stationId, pose)],
        reviewClient.withOwnSince(this.basisRevision),
        this.withTheirs(pose),
      );
      return isMoved ? { id: stationId, positionM: pose.position_m } : null;
    }
    const before = new Set(Object.keys(reviewClient.review.peek()?.stations ?? {}));
    const isDone = await reviewClient.commit(t('add a station'), [addStation(pose)]);
    const added = Object.keys(reviewClient.review.peek()?.stations ?? {}).find((id) => !before.has(id));
    if (!isDone || added === undefined) return null;
    store.chooseStation(added);
    return { id: added, positionM: pose.position_m };
  }

  /** The change that keeps a pose and what others did to the station meanwhile, see `joinedPose`. */
  private withTheirs(pose: Pose): () => Change[] | null {
    const { basis } = this;
    return () => {
      const theirs = this.follower.stations.peek().find(({ id }) => id === basis?.id);
      const joined = basis === null || theirs === undefined ? null : joinedPose(basis, pose, theirs);
      return joined === null || basis === null ? null : [moveStation(basis.id, joined)];
    };
  }

  private letGo(): void {
    if (this.follower.layers.peek() !== null) this.paint.takeBack();
    batch(() => {
      this.store.editing.underWay.value = null;
      this.store.editing.preview.value = null;
      this.store.editing.surfaceChange.value = null;
    });
    this.view.showChange(null);
    if (this.detail < 1) this.view.setDetail(1);
    this.view.requestFrame();
  }

  private nextSequence(): number {
    this.sequence++;
    return this.sequence;
  }

  private usualHeightM(floorId: string): number {
    return usualHeightM(this.follower.stations.peek(), floorId, this.loaded.plan.settings.instrument_heights_m);
  }
}

/** A station that was moved or added; scene frame. */
interface Placed {
  readonly id: string;
  readonly positionM: Point;
}

/** Why a station is not moved; null: it may be. */
function whyItStays({ id, isFixed, isLocked }: DraftStation): string | null {
  if (isFixed) return t('Station {id} is already scanned: its position can’t be changed.', { id });
  return isLocked ? t('Station {id} is locked. Unlock it to move it.', { id }) : null;
}
