import { expect, test } from 'vitest';
import { checkedBy, type JsonSchema } from './schema-check.ts';

const SCHEMA: JsonSchema = {
  $defs: {
    Leg: {
      type: 'object',
      properties: { to: { type: 'string', minLength: 1 }, length_m: { type: 'number', exclusiveMinimum: 0 } },
      required: ['to', 'length_m'],
    },
  },
  type: 'object',
  properties: {
    kind: { enum: ['foot', 'robot'] },
    n: { type: 'integer', default: 3 },
    share: { type: 'number', minimum: 0, maximum: 1, default: 0 },
    legs: { type: 'array', items: { $ref: '#/$defs/Leg' }, minItems: 1 },
    at: {
      anyOf: [{ type: 'array', prefixItems: [{ type: 'number' }, { type: 'number' }], maxItems: 2 }, { type: 'null' }],
    },
    by_floor: { type: 'object', additionalProperties: { type: 'boolean' }, default: {} },
  },
  required: ['kind', 'legs', 'at'],
};
const way = (instead: object = {}) => ({ kind: 'foot', legs: [{ to: 'S001', length_m: 2 }], at: null, ...instead });

test('what fits is taken, what may be missing is filled in, what is not known is left out', () => {
  expect(checkedBy(SCHEMA, way({ at: [1, 2.5], by_floor: { F0: true }, later: 1 }))).toEqual({
    kind: 'foot',
    n: 3,
    share: 0,
    legs: [{ to: 'S001', length_m: 2 }],
    at: [1, 2.5],
    by_floor: { F0: true },
  });
});

test('figures may be off by what they are rounded to', () => {
  expect(checkedBy(SCHEMA, way({ share: 1.0000004 }))).toMatchObject({ share: 1.0000004 });
});

test.each([
  [null, 'the whole file is null, expected object'],
  [[], 'the whole file is [], expected object'],
  [way({ kind: 'boat' }), 'kind is "boat", expected "foot" or "robot"'],
  [way({ n: 1.5 }), 'n is 1.5, expected integer'],
  [way({ share: 1.1 }), 'share is 1.1, expected <=1'],
  [way({ share: -1 }), 'share is -1, expected >=0'],
  [way({ share: 'half' }), 'share is "half", expected number'],
  [way({ legs: {} }), 'legs is {}, expected array'],
  [way({ legs: [] }), 'legs is [], expected at least 1 entries'],
  [way({ legs: [{ to: '', length_m: 2 }] }), 'legs.0.to is "", expected string'],
  [way({ legs: [{ to: 'S001' }] }), 'legs.0.length_m is undefined, expected a value'],
  [way({ legs: [{ to: 'S001', length_m: 0 }] }), 'legs.0.length_m is 0, expected >0'],
  [way({ at: [1, 2, 3] }), 'at is [1,2,3], expected at most 2 entries'],
  [way({ at: [1, null] }), 'at.1 is null, expected number'],
  [way({ by_floor: { F0: 1 } }), 'by_floor.F0 is 1, expected boolean'],
])('the first value that does not fit is told by its keys: %j', (value, told) => {
  expect(() => checkedBy(SCHEMA, value)).toThrow(told);
});
