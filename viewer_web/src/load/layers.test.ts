import { expect, test } from 'vitest';
import { decodeValues, parseLayers, rampLayersOf } from './layers.ts';

const LAYERS = {
  schema: 'tlsplan/layers/1',
  n_patches: 3,
  layers: [
    {
      id: 'range',
      title: 'Best range',
      unit: 'm',
      step: 0.0001,
      none: 65535,
      file: 'layers/range.u16',
      better: 'low',
    },
  ],
  reasons: ['covered'],
};

test('layers that fit are taken, keys of later versions left out of sight', () => {
  const layers = parseLayers({ ...LAYERS, qualities: [{}], future: 1 });
  expect(rampLayersOf(layers)[0]).toMatchObject({ kind: 'ramp', id: 'range', step: 0.0001 });
  expect(rampLayersOf(null)).toEqual([]);
});

test('an error in layers.json names the key and the remedy', () => {
  const damaged = { ...LAYERS, layers: [{ ...LAYERS.layers[0], step: 'small' }] };
  expect(() => parseLayers(damaged)).toThrow(/layers\.0\.step is "small", expected number.*Write the plan again/);
  expect(() => parseLayers({ ...LAYERS, schema: 'tlsplan/layers/2' })).toThrow(/schema is "tlsplan\/layers\/2"/);
});

test('values are one or two bytes each, little endian, and as many as there are patches', () => {
  const buffer = Uint8Array.of(1, 0, 0, 1, 255, 255).buffer;
  expect([...decodeValues('layers/range.u16', buffer, 3, 2)]).toEqual([1, 256, 65535]);
  expect([...decodeValues('reason.u8', buffer, 6, 1)]).toEqual([1, 0, 0, 1, 255, 255]);
  expect(() => decodeValues('layers/range.u16', buffer, 4, 2)).toThrow(/6 bytes, expected 8 for 4 patches/);
});
