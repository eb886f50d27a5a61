/** Checks what is loaded by a JSON Schema of those that pydantic makes of models, and fills in what may be missing. */

export interface JsonSchema {
  readonly $ref?: string;
  readonly anyOf?: readonly JsonSchema[];
  readonly const?: unknown;
  readonly enum?: readonly unknown[];
  readonly type?: string;
  readonly properties?: Readonly<Record<string, JsonSchema>>;
  readonly required?: readonly string[];
  readonly additionalProperties?: JsonSchema | boolean;
  readonly items?: JsonSchema;
  readonly prefixItems?: readonly JsonSchema[];
  readonly minItems?: number;
  readonly maxItems?: number;
  readonly minLength?: number;
  readonly minimum?: number;
  readonly maximum?: number;
  readonly exclusiveMinimum?: number;
  readonly default?: unknown;
  readonly $defs?: Readonly<Record<string, JsonSchema>>;
}

/** The first value that does not fit: its keys, and what was expected there. */
export class Misfit extends Error {
  constructor(
    readonly keys: readonly (string | number)[],
    readonly received: string,
    readonly expected: string,
  ) {
    super(`${keys.join('.') || 'the whole file'} is ${received}, expected ${expected}`);
  }
}

/** Figures are rounded where they are written. */
const ROUNDING = 1e-6;

/** The value as its schema says, without keys that are not in it; throws `Misfit`. */
export function checkedBy(root: JsonSchema, value: unknown): unknown {
  return check(root, value, []);

  function check(schema: JsonSchema, found: unknown, keys: readonly (string | number)[]): unknown {
    const fits = (condition: boolean, expected: string) => {
      if (!condition) throw new Misfit(keys, shown(found), expected);
    };
    if (schema.$ref !== undefined) {
      return check(root.$defs?.[schema.$ref.slice('#/$defs/'.length)] as JsonSchema, found, keys);
    }
    if (schema.anyOf !== undefined) {
      const others = schema.anyOf.filter(({ type }) => type !== 'null');
      if (found === null && others.length < schema.anyOf.length) return null;
      return check(others[0] as JsonSchema, found, keys); // models have no other choice than null
    }
    if (schema.const !== undefined) fits(found === schema.const, JSON.stringify(schema.const));
    if (schema.enum !== undefined)
      fits(schema.enum.includes(found), schema.enum.map((each) => `"${each}"`).join(' or '));
    switch (schema.type) {
      case 'string':
        fits(typeof found === 'string' && found.length >= (schema.minLength ?? 0), 'string');
        return found;
      case 'boolean':
        fits(typeof found === 'boolean', 'boolean');
        return found;
      case 'integer':
      case 'number':
        fits(Number.isFinite(found) && (schema.type === 'number' || Number.isInteger(found)), schema.type);
        checkRange(schema, found as number, fits);
        return found;
      case 'array': {
        fits(Array.isArray(found), 'array');
        const list = found as readonly unknown[];
        fits(list.length >= (schema.minItems ?? 0), `at least ${schema.minItems} entries`);
        fits(list.length <= (schema.maxItems ?? Infinity), `at most ${schema.maxItems} entries`);
        return list.map((each, at) => check(schema.prefixItems?.[at] ?? schema.items ?? {}, each, [...keys, at]));
      }
      case 'object': {
        fits(typeof found === 'object' && found !== null && !Array.isArray(found), 'object');
        return checkObject(schema, found as Record<string, unknown>, keys);
      }
      default:
        return found;
    }
  }

  function checkObject(schema: JsonSchema, found: Record<string, unknown>, keys: readonly (string | number)[]) {
    if (schema.properties === undefined) {
      const inner = typeof schema.additionalProperties === 'object' ? schema.additionalProperties : {};
      return Object.fromEntries(Object.entries(found).map(([key, each]) => [key, check(inner, each, [...keys, key])]));
    }
    return Object.fromEntries(
      Object.entries(schema.properties).map(([key, inner]) => {
        if (found[key] !== undefined) return [key, check(inner, found[key], [...keys, key])];
        if (inner.default === undefined) throw new Misfit([...keys, key], 'undefined', 'a value');
        return [key, inner.default];
      }),
    );
  }
}

function checkRange(schema: JsonSchema, found: number, fits: (condition: boolean, expected: string) => void) {
  const { minimum = -Infinity, maximum = Infinity, exclusiveMinimum = -Infinity } = schema;
  fits(found >= minimum - ROUNDING, `>=${minimum}`);
  fits(found <= maximum + ROUNDING, `<=${maximum}`);
  fits(found > exclusiveMinimum, `>${exclusiveMinimum}`);
}

function shown(value: unknown): string {
  const text = JSON.stringify(value) ?? String(value);
  return text.length <= 60 ? text : `${text.slice(0, 60)}...`;
}
