import { Vector3 } from 'three';
import { expect, test } from 'vitest';
import type { Beams } from '../load/cloud.ts';
import { cloudPoint } from '../load/cloud.ts';
import type { ThinnedCloud } from '../load/cloud-rows.ts';
import { countingOf } from '../network/graph.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { BeamFinder, directionAt, frameOf, panoramaPixels } from './panorama-image.ts';
import { rampBytes, rampRgb } from './range-ramp.ts';
import type { ShownStation } from './shown.ts';
import { cssColor, stationColor } from './station-color.ts';
import { rowsOf, sorted } from './station-order.ts';
import { weakGlyph } from './weak-glyph.ts';

const RAD = Math.PI / 180;

/** Rows 40, 5 and -20 degrees up, beginning at different azimuths. */
const FULL: Beams = {
  rows: 3,
  columns: 8,
  rangeStepM: 0.01,
  elevationsRad: Float32Array.of(40 * RAD, 5 * RAD, -20 * RAD),
  azimuthsRad: Float32Array.of(0, 10 * RAD, -5 * RAD),
  azimuthStepRad: 45 * RAD,
};
const SECTOR: Beams = { ...FULL, columns: 3, azimuthsRad: new Float32Array(3).fill(30 * RAD) };

const between = (a: number, b: number): number => Math.abs(Math.atan2(Math.sin(a - b), Math.cos(a - b)));

test('the beam of a direction is the nearest of the nearest row', () => {
  const finder = new BeamFinder(FULL);
  for (let azimuth = -360; azimuth < 720; azimuth += 7) {
    for (const elevation of [-60, -20, -10, -6, 4, 20, 30, 80]) {
      const beam = finder.beamAt({ azimuthRad: azimuth * RAD, elevationRad: elevation * RAD });
      const [row, column] = [Math.floor(beam / 8), beam % 8];
      const gaps = [...FULL.elevationsRad].map((rad) => Math.abs(rad - elevation * RAD));
      expect(gaps[row]).toBeCloseTo(Math.min(...gaps), 9);
      const own = FULL.azimuthsRad[row] + column * FULL.azimuthStepRad;
      expect(between(own, azimuth * RAD), `${azimuth} ${elevation}`).toBeLessThanOrEqual(22.5 * RAD + 1e-6);
    }
  }
});

test('outside a sector no beam is', () => {
  const finder = new BeamFinder(SECTOR);
  const at = (azimuth: number): number => finder.beamAt({ azimuthRad: azimuth * RAD, elevationRad: 40 * RAD });
  expect([at(30), at(75), at(120), at(200), at(0)]).toEqual([0, 1, 2, -1, -1]);
});

test('a panorama runs to the right as one turns to the right, and from the highest row down', () => {
  const frame = frameOf(FULL, 360);
  expect(frame.spanRad).toBeCloseTo(2 * Math.PI);
  expect(frame.height).toBe(60);
  const [left, right] = [directionAt(frame, 10, 0), directionAt(frame, 20, 59)];
  expect(right.azimuthRad).toBeLessThan(left.azimuthRad);
  expect(left.elevationRad).toBeGreaterThan(right.elevationRad);
  expect(left.elevationRad).toBeLessThanOrEqual(40 * RAD);
});

test('pixels have the colour of their return, and none where there is none', () => {
  const rangeSteps = new Uint16Array(24);
  rangeSteps[9] = 300;
  const cloud = { rangeSteps, intensity: new Uint8Array(24).fill(255), nReturns: 1 };
  const thinned: ThinnedCloud = { cloud, beams: FULL };
  const frame = frameOf(FULL, 72);
  const pixels = panoramaPixels(thinned, frame, (rangeM, intensity) => [10 * rangeM, 100 * intensity, 7]);
  const drawn: number[] = [];
  for (let i = 0; i < pixels.length / 4; i++) {
    if (pixels[4 * i + 3] === 0) continue;
    expect([...pixels.subarray(4 * i, 4 * i + 4)]).toEqual([30, 100, 7, 255]);
    drawn.push(i);
  }
  // A beam in eight of one row in three.
  expect(drawn.length).toBeGreaterThan(10);
  const [x, y, z] = cloudPoint(cloud, FULL, 1, 1)!;
  for (const i of drawn) {
    const { azimuthRad } = directionAt(frame, i % 72, Math.floor(i / 72));
    expect(between(azimuthRad, Math.atan2(y, x))).toBeLessThan(23 * RAD);
  }
  expect(z).toBeGreaterThan(0);
});

test('colours by range run from dark to bright and stay colours', () => {
  expect(rampRgb(-1)).toEqual(rampRgb(0));
  expect(rampRgb(2)).toEqual(rampRgb(1));
  const light = [...Array(20).keys()].map((i) => rampRgb(i / 19)).map(([r, g, b]) => 0.2 * r + 0.7 * g + 0.1 * b);
  for (let i = 1; i < 20; i++) expect(light[i]).toBeGreaterThan(light[i - 1]);
  expect(rampBytes()).toHaveLength(768);
});

test('twenty stations have twenty colours, neighbours far apart', () => {
  const colors = [...Array(20).keys()].map((i) => stationColor(i + 1));
  expect(new Set(colors.map(cssColor)).size).toBe(20);
  for (const color of colors) for (const x of color) expect(x >= 0 && x <= 1).toBe(true);
  for (let i = 1; i < 20; i++) {
    expect(Math.hypot(...colors[i].map((x, k) => x - colors[i - 1][k]))).toBeGreaterThan(0.3);
  }
});

const shown = (id: string, order: number): ShownStation => ({
  id,
  number: order,
  order,
  floorId: 'F0',
  positionM: [0, 0, 0],
  marks: [],
});

test('the list of stations sorts by walk, name and figures, equals by walk', () => {
  const plan = smallPlan();
  const stations = [shown('S010', 4), shown('S003', 3), shown('S002', 2), shown('S001', 1)];
  const rows = rowsOf(stations, plan, plan.registration.links, countingOf(plan));
  const by = (key: Parameters<typeof sorted>[1]): string[] => sorted(rows, key).map(({ station }) => station.id);
  expect(by('order')).toEqual(['S001', 'S002', 'S003', 'S010']);
  expect(by('id')).toEqual(['S001', 'S002', 'S003', 'S010']);
  expect(by('lost')).toEqual(['S003', 'S002', 'S001', 'S010']);
  expect(by('seen')).toEqual(['S001', 'S002', 'S003', 'S010']);
  expect(by('links')).toEqual(['S001', 'S002', 'S003', 'S010']);
  expect(rows[0]).toMatchObject({ seenM2: null, lostM2: null, nLinks: 0 });
  expect(rows[3].nLinks).toBe(1);
});

test('a draft’s own figures go before those of the plan', () => {
  const plan = smallPlan();
  const worth = { covered_area_m2: 3, own_area_m2: 0, lost_area_m2: 0, losses: [] };
  const [row] = rowsOf([{ ...shown('S001', 1), worth }], plan, [], countingOf(plan));
  expect(row).toMatchObject({ seenM2: 3, lostM2: 0 });
});

test('the sign of a weak axis lies along it, or around it', () => {
  const middle = new Vector3(1, 2, 3);
  const slide = weakGlyph(middle, [0, 1, 0], false);
  expect(slide.slice(0, 6).map((x) => +x.toFixed(6))).toEqual([1, 1.3, 3, 1, 2.7, 3]);
  const turn = weakGlyph(middle, [0, 0, 1], true);
  expect(turn.length % 6).toBe(0);
  // All of the arc lies level.
  for (let i = 2; i < 6 * 24; i += 3) expect(turn[i]).toBeCloseTo(3);
});
