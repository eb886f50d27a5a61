/** viewer/layers.json and the files it names: figures and reasons patch by patch (docs/formats/stage.md). */
import type { PatchValues, RampLayer } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import { PlanLoadError } from './plan-load-error.ts';
import { checkedBy, type JsonSchema, Misfit } from './schema-check.ts';

const LAYERS_SCHEMA = 'tlsplan/layers/1';

type Point = readonly [number, number, number];

export interface LayersJson {
  readonly schema: typeof LAYERS_SCHEMA;
  readonly n_patches: number;
  readonly layers: readonly {
    readonly id: string;
    readonly title: string;
    readonly unit: string;
    readonly step: number;
    readonly none: number;
    readonly file: string;
    readonly better: 'low' | 'high';
  }[];
  readonly reasons: readonly string[];
  /** File of how much of each patch counts, in 255ths; null: all of it. */
  readonly counted: string | null;
  /** File of the piece of unseen surface that each patch is of. */
  readonly pieces: string | null;
  /** Rooms with required surface, by their number in `file`; null: an older version made the plan. */
  readonly rooms: {
    readonly file: string;
    readonly none: number;
    readonly list: readonly {
      /** Empty: a region of free floor. */
      readonly name: string;
      readonly source_id: string;
      /** Empty: its surface is of no floor. */
      readonly floor: string;
      /** On its ground, and around its surface; local frame. */
      readonly label: Point;
      readonly box: readonly [Point, Point];
    }[];
  } | null;
}

const [STRING, NUMBER]: JsonSchema[] = [{ type: 'string' }, { type: 'number' }];
const objectOf = (properties: Record<string, JsonSchema>): JsonSchema => ({ type: 'object', properties });
const tupleOf = (items: JsonSchema, n: number): JsonSchema => ({ type: 'array', items, minItems: n, maxItems: n });
/** Null by default. */
const maybe = (schema: JsonSchema): JsonSchema => ({ anyOf: [schema, { type: 'null' }], default: null });
const POINT = tupleOf(NUMBER, 3);

const SCHEMA = objectOf({
  schema: { const: LAYERS_SCHEMA },
  n_patches: NUMBER,
  layers: {
    type: 'array',
    items: objectOf({
      id: STRING,
      title: STRING,
      unit: STRING,
      step: NUMBER,
      none: NUMBER,
      file: STRING,
      better: { enum: ['low', 'high'] },
    }),
  },
  reasons: { type: 'array', items: STRING, default: [] },
  counted: maybe(STRING),
  pieces: maybe(STRING),
  rooms: maybe(
    objectOf({
      file: STRING,
      none: NUMBER,
      list: {
        type: 'array',
        items: objectOf({ name: STRING, source_id: STRING, floor: STRING, label: POINT, box: tupleOf(POINT, 2) }),
      },
    }),
  ),
});

/** Check a parsed layers.json. */
export function parseLayers(json: unknown): LayersJson {
  try {
    return checkedBy(SCHEMA, json) as LayersJson;
  } catch (misfit) {
    if (!(misfit instanceof Misfit)) throw misfit;
    const { keys, received, expected } = misfit;
    const part = keys.join('.') || t('the whole file');
    throw new PlanLoadError(
      t('viewer/layers.json: {part} is {found}, expected {expected}. Write the plan again with `tlsplan plan`.', {
        part,
        found: received,
        expected,
      }),
    );
  }
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
