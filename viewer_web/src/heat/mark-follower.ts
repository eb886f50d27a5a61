/** Points out the patches that the store's choices are about: a pair's shared surface, an unseen piece, a station's own. */
import { effect } from '@preact/signals';
import { fetchPatchValues, fetchSeen, type LoadedPlan } from '../load/fetch-plan.ts';
import type { Building } from '../scene/building.ts';
import type { PatchPlaces } from '../scene/patch-places.ts';
import { boxOf } from '../scene/piece-parts.ts';
import type { Store, UnseenFocus } from '../store.ts';
import { NOT_ACHIEVABLE, type PatchValues, REASON } from './layers.ts';
import { markedArea, ownMarks, sharedMarks } from './marks.ts';
import type { PatchPaint } from './patch-paint.ts';

export class MarkFollower {
  private latest = 0;
  private reasonOfPatch: PatchValues | null = null;
  private readonly end: () => void;

  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly building: Building,
    private readonly paint: PatchPaint,
    private readonly places: () => PatchPlaces,
    private readonly requestFrame: () => void,
  ) {
    this.end = effect(() => {
      void this.follow();
    });
  }

  dispose(): void {
    this.latest = -1;
    this.end();
  }

  private async follow(): Promise<void> {
    const { store } = this;
    const [pair, focus, draft] = [store.pair.value, store.unseenFocus.value, store.draft.value];
    const own = store.showsOwn.value ? store.stationId.value : null;
    store.stationSource.value;
    const turn = ++this.latest;
    if (pair === null && focus === null && own === null) {
      this.set(null);
      return;
    }
    store.marking.value = { kind: 'loading' };
    try {
      let marks: Uint8Array;
      if (pair !== null) {
        const [a, b] = await Promise.all(pair.map((id) => this.seen(id)));
        marks = sharedMarks(a, b, this.paint.timesSeen.length);
      } else if (focus !== null) marks = this.pieceMarks(focus, await this.reasons());
      else marks = ownMarks(await this.seen(own ?? ''), this.paint.timesSeen);
      if (turn === this.latest) this.set(marks);
    } catch (error) {
      if (turn !== this.latest) return;
      this.set(null);
      const hint = draft === null ? '' : ' Stations of the draft need the live side.';
      store.marking.value = { kind: 'failed', message: `${(error as Error).message}${hint}` };
    }
  }

  private set(marks: Uint8Array | null): void {
    this.building.setMarks(marks);
    this.store.marking.value =
      marks === null ? { kind: 'none' } : { kind: 'shown', areaM2: markedArea(marks, this.paint.areas) };
    this.requestFrame();
  }

  private async seen(id: string): Promise<Uint8Array> {
    const live = await this.store.stationSource.peek()?.seen(id);
    if (live) return live;
    const station = this.loaded.stage.stations.find((one) => one.id === id);
    if (station === undefined) throw new Error(`The plan has no station ${id}.`);
    return fetchSeen(this.loaded, station);
  }

  /** Why each patch is unseen; null: an older version made the plan. */
  private async reasons(): Promise<PatchValues | null> {
    if (this.loaded.layers === null) return null;
    this.reasonOfPatch ??= await fetchPatchValues(this.loaded, REASON, new AbortController().signal);
    return this.reasonOfPatch;
  }

  private pieceMarks({ surface, piece }: UnseenFocus, reasons: PatchValues | null): Uint8Array {
    const { stage } = this.loaded;
    const marks = new Uint8Array(this.paint.timesSeen.length);
    const element = stage.elements.find(({ sceneIndex }) => sceneIndex === surface.element);
    const shown = surface.pieces[piece];
    if (element === undefined || shown === undefined) return marks;
    const box = boxOf(shown, stage.offsetM);
    const { timesSeen } = this.paint;
    const reason = this.loaded.layers?.reasons.indexOf(surface.reason);
    const isUnseen = (patch: number): boolean =>
      reasons !== null ? reasons[patch] === reason : timesSeen[patch] === 0 || timesSeen[patch] === NOT_ACHIEVABLE;
    for (const patch of this.places().patchesIn(element, box, isUnseen)) marks[patch] = 1;
    return marks;
  }
}
