import { afterEach, expect, test } from 'vitest';
import type { PlanJson } from '../load/plan-json.ts';
import { units } from '../panels/units.ts';
import { northOf, siteOf, siteWords } from './site.ts';

type Georeference = NonNullable<PlanJson['scene']['georeference']>;
const told = (part: Partial<Georeference>): Pick<PlanJson['scene'], 'georeference'> => ({
  georeference: { crs_name: '', map_unit: '', to_map: null, true_north: null, ...part } as Georeference,
});

/** A map conversion as IFC has it: the scene's x axis points 30 degrees north of east, at 0.9996. */
const [turn, scale] = [Math.PI / 6, 0.9996];
const [cos, sin] = [scale * Math.cos(turn), scale * Math.sin(turn)];
const plan = told({
  crs_name: 'EPSG:25832',
  to_map: [
    [cos, -sin, 0, 512_345.678],
    [sin, cos, 0, 5_412_345.678],
    [0, 0, 1, 230],
    [0, 0, 0, 1],
  ],
});
afterEach(() => {
  units.value = 'm';
});

test('site coordinates are the map conversion of IFC, and come back to the millimetre', () => {
  const site = siteOf(plan)!;
  const [e, n, h] = site.toSite([10, 20, 1.7]);
  // IfcMapConversion: E = e0 + s (x cos - y sin), N = n0 + s (x sin + y cos), H = h0 + z.
  expect(e).toBeCloseTo(512_345.678 + scale * (10 * Math.cos(turn) - 20 * Math.sin(turn)), 6);
  expect(n).toBeCloseTo(5_412_345.678 + scale * (10 * Math.sin(turn) + 20 * Math.cos(turn)), 6);
  expect(h).toBeCloseTo(231.7, 9);
  for (const [k, x] of site.toScene([e, n, h]).entries()) expect(x).toBeCloseTo([10, 20, 1.7][k], 6);
});

test('grid north is where the northing grows and the easting does not', () => {
  const site = siteOf(plan)!;
  const { rad, name } = northOf(plan);
  expect(name).toBe('Grid north');
  const from = site.toSite([0, 0, 0]);
  const to = site.toSite([Math.sin(rad), Math.cos(rad), 0]);
  expect(to[0] - from[0]).toBeCloseTo(0, 6);
  expect(to[1] - from[1]).toBeCloseTo(scale, 6);
  // The x axis lies 30 degrees north of east, so north is 30 degrees clockwise of y.
  expect(rad).toBeCloseTo(turn, 9);
});

test('without a map conversion true north counts where it is told, and there are no site coordinates', () => {
  expect(siteOf({ georeference: null })).toBeNull();
  expect(northOf({ georeference: null })).toEqual({ rad: 0, name: '+y; north not given', isGiven: false });
  const turned = told({ true_north: [Math.SQRT1_2, Math.SQRT1_2] });
  expect(siteOf(turned)).toBeNull();
  expect(northOf(turned)).toEqual({ rad: expect.closeTo(Math.PI / 4), name: 'True north', isGiven: true });
});

test('site coordinates are read in the map’s own foot', () => {
  units.value = 'ft';
  const at = {
    to_map: [
      [1, 0, 0, 609_601.2192],
      [0, 1, 0, 0],
      [0, 0, 1, 0],
      [0, 0, 0, 1],
    ],
  } as Partial<Georeference>;
  // 2 000 000 US survey feet are 609 601.2192 m by definition; in international feet that is 4 ft more.
  expect(siteWords(siteOf(told({ ...at, map_unit: 'US survey foot' }))!, [0, 0, 0])).toBe(
    'E 2000000.00, N 0.00, H 0.00',
  );
  expect(siteWords(siteOf(told(at))!, [0, 0, 0])).toBe('E 2000004.00, N 0.00, H 0.00');
});
