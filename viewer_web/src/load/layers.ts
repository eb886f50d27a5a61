/** viewer/layers.json and the files it names: figures and reasons patch by patch (docs/formats/stage.md). */
import * as v from 'valibot';
import type { PatchValues, RampLayer } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import { PlanLoadError } from './plan-load-error.ts';

const LAYERS_SCHEMA = 'tlsplan/layers/1';

const Point = v.tuple([v.number(), v.number(), v.number()]);

const LayersJson = v.object({
  schema: v.literal(LAYERS_SCHEMA),
  n_patches: v.number(),
  layers: v.array(
    v.object({
      id: v.string(),
      title: v.string(),
      unit: v.string(),
      step: v.number(),
      none: v.number(),
      file: v.string(),
      better: v.picklist(['low', 'high']),
    }),
  ),
  reasons: v.optional(v.array(v.string()), []),
  /** File of how much of each patch counts, in 255ths; null: all of it. */
  counted: v.optional(v.nullable(v.string()), null),
  /** File of the piece of unseen surface that each patch is of. */
  pieces: v.optional(v.nullable(v.string()), null),
  /** Rooms with required surface, by their number in `file`; null: an older version made the plan. */
  rooms: v.optional(
    v.nullable(
      v.object({
        file: v.string(),
        none: v.number(),
        list: v.array(
          v.object({
            /** Empty: a region of free floor. */
            name: v.string(),
            source_id: v.string(),
            /** Empty: its surface is of no floor. */
            floor: v.string(),
            /** On its ground, and around its surface; local frame. */
            label: Point,
            box: v.tuple([Point, Point]),
          }),
        ),
      }),
    ),
    null,
  ),
});

export type LayersJson = v.InferOutput<typeof LayersJson>;

/** Check a parsed layers.json. */
export function parseLayers(json: unknown): LayersJson {
  const result = v.safeParse(LayersJson, json);
  if (result.success) return result.output;
  const issue = result.issues[0];
  throw new PlanLoadError(
    t('viewer/layers.json: {part} is {found}, expected {expected}. Write the plan again with `tlsplan plan`.', {
      part: v.getDotPath(issue) ?? t('the whole file'),
      found: issue.received,
      expected: String(issue.expected),
    }),
  );
}

export function rampLayersOf(layers: LayersJson | null): RampLayer[] {
  return (layers?.layers ?? []).map(({ id, title, unit, step, none, better }) => ({
    kind: 'ramp',
    id,
    title,
    unit,
    step,
    none,
    better,
  }));
}

/** Values of one patch each, one or two bytes; throws where the file is of another length. */
export function decodeValues(file: string, buffer: ArrayBuffer, nPatches: number, bytesEach: 1 | 2): PatchValues {
  if (buffer.byteLength !== bytesEach * nPatches) {
    throw new PlanLoadError(
      t('{file}: {n} bytes, expected {expected} for {patches} patches. Write the plan again with `tlsplan plan`.', {
        file: `viewer/${file}`,
        n: buffer.byteLength,
        expected: bytesEach * nPatches,
        patches: nPatches,
      }),
    );
  }
  // Little endian, as every machine that runs a browser.
  return bytesEach === 1 ? new Uint8Array(buffer) : new Uint16Array(buffer);
}
