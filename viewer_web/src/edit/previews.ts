/** Asks the server what one station would see somewhere else, and draws the difference over the draft's own values. */
import type { ApiClient } from '../api/client.ts';
import type { DraftLink, Point } from '../api/documents.ts';
import { type PatchDelta, readPatchDelta } from '../api/framing.ts';
import type { PatchValues } from '../heat/layers.ts';
import { TIMES_SEEN } from '../heat/layers.ts';

export interface PreviewHead {
  readonly sequence: number;
  readonly revision: number;
  readonly n_patches_changed: number;
  readonly position: Point;
  readonly instrument_height_m: number;
  readonly admissible: boolean;
  /** Why it is not the place that was asked for; empty where it is. */
  readonly reason: string;
  readonly coverage: { readonly fraction_of_achievable: number };
  readonly floors: readonly { readonly floor: string; readonly fraction_of_achievable: number }[];
  readonly station: { readonly covered_area_m2: number; readonly own_area_m2: number };
  readonly links: readonly DraftLink[];
  readonly n_stations: number;
  readonly registration: { readonly connected: boolean; readonly n_networks: number };
}

export interface Preview {
  readonly head: PreviewHead;
  readonly delta: PatchDelta;
  /** Whose values `delta.layerValues` are. */
  readonly layerId: string;
}

export interface PreviewQuestion {
  readonly stationId: string | null;
  readonly floorId: string;
  readonly positionM: Point;
  readonly heightM: number;
  readonly layerId: string;
}

export async function askPreview(
  client: ApiClient,
  question: PreviewQuestion,
  sequence: number,
  signal?: AbortSignal,
): Promise<Preview> {
  const body = {
    station: question.stationId,
    floor: question.floorId,
    position: question.positionM,
    instrument_height_m: question.heightM,
    layer: question.layerId,
    sequence,
  };
  const { head, body: numbers } = await client.postFramed<PreviewHead>('live/preview', body, signal);
  return { head, delta: readPatchDelta(numbers, head.n_patches_changed), layerId: question.layerId };
}

/** The draft's own values by layer, as they were when it was committed. */
export type BaseValues = (layerId: string) => PatchValues | undefined;

/** What changes of patches are drawn on. */
export interface PatchCanvas {
  patchPatches(
    indices: ArrayLike<number>,
    timesSeen: ArrayLike<number> | null,
    layerId: string,
    values: ArrayLike<number> | null,
  ): void;
}

/** Draws one preview at a time: the one before is taken back first, so lost answers leave no trace. */
export class PreviewPaint {
  private drawn: { readonly preview: Preview; readonly base: BaseValues } | null = null;

  constructor(private readonly canvas: PatchCanvas) {}

  show(preview: Preview, base: BaseValues): void {
    this.takeBack();
    if (base(TIMES_SEEN) === undefined) return;
    const { delta, layerId } = preview;
    const hasLayer = layerId !== TIMES_SEEN && base(layerId) !== undefined;
    this.canvas.patchPatches(delta.patches, delta.timesSeen, layerId, hasLayer ? delta.layerValues : null);
    this.drawn = { preview, base };
  }

  /** Back to the draft's own values. */
  takeBack(): void {
    if (this.drawn === null) return;
    const { preview, base } = this.drawn;
    this.drawn = null;
    const indices = preview.delta.patches;
    const at = (values: PatchValues | undefined): number[] | null =>
      values === undefined ? null : Array.from(indices, (index) => values[index]);
    const layer = preview.layerId === TIMES_SEEN ? undefined : base(preview.layerId);
    this.canvas.patchPatches(indices, at(base(TIMES_SEEN)), preview.layerId, at(layer));
  }

  /** The values on screen are new ones: there is nothing to take back any more. */
  forget(): void {
    this.drawn = null;
  }
}
