/** Highlights the patches that the store's choices are about: a pair's shared surface, an unseen piece, a station's own. */

import { effect } from '@preact/signals';
import { t } from '../language/language.ts';
import { fetchLost, fetchPatchValues, fetchPieces, fetchSeen, type LoadedPlan } from '../load/fetch-plan.ts';
import type { Building } from '../scene/building.ts';
import type { PatchPlaces } from '../scene/patch-places.ts';
import { boxOf } from '../scene/piece-parts.ts';
import { asksMore, parseLost } from '../stations/losses.ts';
import type { Store } from '../store.ts';
import type { UnseenFocus } from '../unseen/state.ts';
import { LEFT_BY_EDITS, NOT_ACHIEVABLE, type PatchValues, REASON } from './layers.ts';
import { listedMarks, markedArea, ownMarks, pieceMarks, sharedMarks } from './marks.ts';
import type { PatchPaint } from './patch-paint.ts';

export class MarkFollower {
  private latest = 0;
  private reasonOfPatch: PatchValues | null = null;
  private pieceOfPatch: Int32Array | null = null;
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
    const requirement = store.ownRequirement.value;
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
      } else if (focus !== null) marks = await this.pieceMarks(focus);
      else marks = await this.ownMarks(own ?? '', requirement);
      // Of a piece the list knows the figure: it is a part of the surface's, and both stand side by side.
      const areaM2 = pair === null ? focus?.surface.pieces[focus.piece]?.area_m2 : undefined;
      if (turn === this.latest) this.set(marks, areaM2);
    } catch (error) {
      if (turn !== this.latest) return;
      this.set(null);
      const hint = draft === null ? '' : ` ${t('Edited stations need live editing.')}`;
      store.marking.value = { kind: 'failed', message: `${(error as Error).message}${hint}` };
    }
  }

  private set(marks: Uint8Array | null, areaM2?: number): void {
    this.building.setMarks(marks);
    this.store.marking.value =
      marks === null ? { kind: 'none' } : { kind: 'shown', areaM2: areaM2 ?? markedArea(marks, this.paint.areas) };
    this.requestFrame();
  }

  private async seen(id: string): Promise<Uint8Array> {
    const live = await this.store.stationSource.peek()?.seen(id);
    if (live) return live;
    const station = this.loaded.stage.stations.find((one) => one.id === id);
    if (station === undefined) throw new Error(t('The plan has no station {id}.', { id }));
    return fetchSeen(this.loaded, station);
  }

  /** What the plan would lose with a station: all of it, or what one requirement would. */
  private async ownMarks(id: string, requirement: string | null): Promise<Uint8Array> {
    const { plan } = this.loaded;
    const nPatches = this.paint.timesSeen.length;
    const bytes = await this.lost(id);
    if (bytes === null) {
      if (!asksMore(plan)) return ownMarks(await this.seen(id), this.paint.timesSeen);
      throw new Error(t('An older version made this plan, without losses per station. Plan again to see them.'));
    }
    const names = plan.requirements.results.map(({ name }) => name);
    const lost = parseLost(bytes, names.length);
    if (lost === null) throw new Error(t('The loss without {id} can’t be read. Write the plan again.', { id }));
    const shown = requirement === null ? lost : lost.filter((_, i) => names[i] === requirement);
    return listedMarks(shown, nPatches);
  }

  /** As viewer/lost; null: an older version made the plan, and nothing computes it. */
  private async lost(id: string): Promise<ArrayBuffer | null> {
    const live = await this.store.stationSource.peek()?.lost(id);
    if (live) return live;
    const station = this.loaded.stage.stations.find((one) => one.id === id);
    const isKnown = this.loaded.plan.stations.some((one) => one.id === id && one.losses !== null);
    return station !== undefined && isKnown ? fetchLost(this.loaded, station) : null;
  }

  /** Why each patch is unseen; null: an older version made the plan. */
  private async reasons(): Promise<PatchValues | null> {
    if (this.loaded.layers === null) return null;
    this.reasonOfPatch ??= await fetchPatchValues(this.loaded, REASON, new AbortController().signal);
    return this.reasonOfPatch;
  }

  /** The piece as plan.json tells it; of the edited plan, and of older ones, what is unseen alike in the piece's box. */
  private async pieceMarks({ surface, piece }: UnseenFocus): Promise<Uint8Array> {
    const { stage } = this.loaded;
    const shown = surface.pieces[piece];
    const element = stage.elements.find(({ sceneIndex }) => sceneIndex === surface.element);
    const nPatches = this.paint.timesSeen.length;
    if (element === undefined || shown === undefined) return new Uint8Array(nPatches);
    if (surface.reason !== LEFT_BY_EDITS) {
      this.pieceOfPatch ??= await fetchPieces(this.loaded);
      if (this.pieceOfPatch !== null) return pieceMarks(this.pieceOfPatch, shown.patch);
    }
    const marks = new Uint8Array(nPatches);
    const isUnseen = this.isUnseenFor(surface.reason, await this.reasons());
    for (const patch of this.places().patchesIn(element, boxOf(shown, stage.offsetM), isUnseen)) marks[patch] = 1;
    return marks;
  }

  /** Whether a patch is one of those that are unseen for a reason, as far as it is known why. */
  private isUnseenFor(reason: string, reasons: PatchValues | null): (patch: number) => boolean {
    const { timesSeen } = this.paint;
    const { layers, plan } = this.loaded;
    if (reason === LEFT_BY_EDITS) {
      const enough = plan.requirements.seen_from;
      return (patch) => timesSeen[patch] < enough;
    }
    if (reasons === null) return (patch) => timesSeen[patch] === 0 || timesSeen[patch] === NOT_ACHIEVABLE;
    const number = layers?.reasons.indexOf(reason);
    return (patch) => reasons[patch] === number;
  }
}
