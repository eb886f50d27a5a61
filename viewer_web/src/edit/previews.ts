/** Asks the server what one station would see somewhere else, and draws the difference over the draft's own values. */
import type { ApiClient } from '../api/client.ts';
import type { Point, PreviewHead, PreviewQuestion } from '../api/documents.ts';
import { type PatchDelta, readPatchDelta } from '../api/framing.ts';
import type { PatchValues } from '../heat/layers.ts';
import { TIMES_SEEN } from '../heat/layers.ts';

export interface Preview {
  readonly head: PreviewHead;
  readonly delta: PatchDelta;
  /** Whose values `delta.layerValues` are. */
  readonly layerId: string;
}

/** Where one station is to stand; the place in the scene frame. */
export interface Wish {
  readonly stationId: string | null;
  readonly floorId: string;
  readonly positionM: Point;
  readonly heightM: number;
  readonly layerId: string;
}

export async function askPreview(
  client: ApiClient,
  wish: Wish,
  sequence: number,
  signal?: AbortSignal,
): Promise<Preview> {
  const question: PreviewQuestion = {
    station: wish.stationId,
    floor: wish.floorId,
    position: wish.positionM,
    instrument_height_m: wish.heightM,
    layer: wish.layerId,
    sequence,
  };
  const { head, body } = await client.postFramed<PreviewHead>('live/preview', question, signal);
  return { head, delta: readPatchDelta(body, head.n_patches_changed), layerId: wish.layerId };
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
