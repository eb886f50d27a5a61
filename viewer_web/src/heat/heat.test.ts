import { expect, test } from 'vitest';
import { differenceLayer } from '../compare/difference.ts';
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { CLASS_SHADING } from '../scene/building-materials.ts';
import { deltaE2000, deltaE2000OfLab } from '../testing/delta-e.ts';
import { runPython } from '../testing/python.ts';
import { classColors, layerColors, rampColors, rgbOf, themed } from './colors.ts';
import { coverageOf } from './element-coverage.ts';
import {
  type ClassLayer,
  layersOf,
  legendClasses,
  NOT_ACHIEVABLE,
  NOT_ASKED,
  type RampLayer,
  REASON_WORDS,
  reasonInWords,
  TIMES_SEEN_LAYER,
  valuesOf,
} from './layers.ts';
import { isSeen, markedArea, ownMarks, pieceMarks, sharedMarks } from './marks.ts';
import { quantity } from './quantity.ts';
import { withinScope, withinScopeAt } from './scope.ts';
import { patchAreas, roundUp, spreadOf, triangleArea } from './statistics.ts';

const RANGE: RampLayer = {
  kind: 'ramp',
  id: 'range',
  title: 'Best range',
  unit: 'm',
  step: 0.001,
  none: 65535,
  better: 'low',
};
const rgb = (colors: Uint8Array, value: number): number[] => [...colors.subarray(3 * value, 3 * value + 3)];
const luminance = ([r, g, b]: number[]): number => 0.2126 * r + 0.7152 * g + 0.0722 * b;

test('a value without a class of its own has the colour of the class below, and grey has its own', () => {
  const colors = classColors(TIMES_SEEN_LAYER, false);
  expect(rgb(colors, 9)).toEqual(rgb(colors, 4));
  expect(rgb(colors, 253)).toEqual(rgb(colors, 4));
  expect(rgb(colors, NOT_ACHIEVABLE)).not.toEqual(rgb(colors, 4));
  expect(new Set([0, 1, 2, 3, 4, 255].map((value) => rgb(colors, value).join())).size).toBe(6);
});

test('what nobody asked for is neither seen nor unseen, whatever is known of it', () => {
  const reasons = Uint8Array.of(0, 1, 255, 255, 255, 9, 0);
  const scoped = withinScope(Uint8Array.of(2, 0, 0, 3, NOT_ACHIEVABLE, NOT_ACHIEVABLE, 254), reasons);
  expect([...scoped]).toEqual([2, 0, NOT_ASKED, NOT_ASKED, NOT_ASKED, NOT_ACHIEVABLE, 253]);
  expect(withinScope(scoped, reasons)).toEqual(scoped);
  expect([...withinScope(scoped, null)]).toEqual([...scoped]);
  expect(Array.from(withinScopeAt([6, 2], [1, 1], reasons))).toEqual([1, NOT_ASKED]);
  const colors = classColors(TIMES_SEEN_LAYER, false);
  const others = [0, 1, 253, NOT_ACHIEVABLE].map((value) => rgb(colors, value).join());
  expect(others).not.toContain(rgb(colors, NOT_ASKED).join());
});

test('legends tell of what need not be covered only where there is such surface', () => {
  for (const layer of [TIMES_SEEN_LAYER, layersOf([], ['covered'], []).at(-1) as ClassLayer]) {
    const labels = (hasNotAsked: boolean) => legendClasses(layer, hasNotAsked).map(({ label }) => label);
    expect(labels(true)).toContain('not to be covered');
    expect(labels(true).filter((label) => label !== 'not to be covered')).toEqual(labels(false));
  }
});

test('dark pages have another grey and the same colours of what is seen', () => {
  const [light, dark] = [classColors(TIMES_SEEN_LAYER, false), classColors(TIMES_SEEN_LAYER, true)];
  expect(rgb(dark, 1)).toEqual(rgb(light, 1));
  expect(rgb(dark, NOT_ACHIEVABLE)).not.toEqual(rgb(light, NOT_ACHIEVABLE));
});

const reasonsOfPlanner = (): string[] =>
  JSON.parse(
    runPython('-c', 'import json; from planner_core.model.unseen import REASONS; print(json.dumps(REASONS))'),
  ) as string[];

test('the darkest face of a class is far nearer to its own colour than to any other of the legend', () => {
  const layers = [...layersOf([], reasonsOfPlanner(), []), differenceLayer('B', true, true)] as ClassLayer[];
  for (const { id, classes } of layers) {
    for (const isDark of [false, true]) {
      for (const { label, color } of classes) {
        const own = rgbOf(themed(color, isDark));
        const [r, g, b] = own.map((channel) => channel * (1 - CLASS_SHADING));
        const others = classes
          .map((other) => rgbOf(themed(other.color, isDark)))
          .filter((rgb) => `${rgb}` !== `${own}`);
        const nearest = Math.min(...others.map((rgb) => deltaE2000([r, g, b], rgb)));
        expect(deltaE2000([r, g, b], own), `${id}, ${label}, dark ${isDark}`).toBeLessThan(0.67 * nearest);
      }
    }
  }
});

test.each([
  [[50, 2.6772, -79.7751], [50, 0, -82.7485], 2.0425],
  [[50, 2.49, -0.001], [50, -2.49, 0.0009], 7.1792],
  [[50, -1, 2], [50, 0, 0], 2.3669],
  [[60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644],
  [[22.7233, 20.0904, -46.694], [23.0331, 14.973, -42.5619], 2.0373],
  [[2.0776, 0.0795, -1.135], [0.9033, -0.0636, -0.5514], 0.9082],
] as const)('differences of colours are those that Sharma, Wu and Dalal list: %j, %j', (one, other, expected) => {
  expect(deltaE2000OfLab(one, other)).toBeCloseTo(expected, 4);
  expect(deltaE2000OfLab(other, one)).toBeCloseTo(expected, 4);
});

test('ramps get darker all the way from good to bad', () => {
  const low = rampColors('low');
  // Channels are whole numbers: up to half a step each.
  const slack = 0.5;
  for (let i = 1; i < 256; i++) {
    expect(luminance(rgb(low, i))).toBeLessThanOrEqual(luminance(rgb(low, i - 1)) + slack);
  }
  expect(luminance(rgb(low, 0)) - luminance(rgb(low, 255))).toBeGreaterThan(150);
  expect(rgb(rampColors('high'), 255)).toEqual(rgb(low, 0));
  expect(layerColors(RANGE, true)).toEqual(low);
});

test('seen or not shows the values of how many stations see a patch', () => {
  const layers = layersOf([RANGE], ['covered', 'occluded'], []);
  expect(layers.map(({ id }) => id)).toEqual(['times_seen', 'seen', 'range', 'reason']);
  expect(layers.map(valuesOf)).toEqual(['times_seen', 'times_seen', 'range', 'reason']);
  expect(layersOf([], [], []).map(({ id }) => id)).toEqual(['times_seen', 'seen']);
});

test('areas of triangles are those of the cross product', () => {
  for (const [a, b, c] of [
    [9, 16, 25],
    [1, 1, 1],
    [2, 2, 4],
  ]) {
    const expected = Math.sqrt(Math.max(0, 4 * a * b - (c - a - b) ** 2)) / 4;
    expect(triangleArea([a, b, c], 0)).toBeCloseTo(expected, 12);
  }
});

/** A right triangle of 6 m² in four patches, one of 2 m² in one. */
const TRIANGLES = {
  count: 2,
  squaredEdgesM2: Float32Array.of(9, 25, 16, 4, 8, 4),
  firstPatch: Int32Array.of(1, 0),
  patchDepth: Uint8Array.of(2, 0),
} as unknown as StageTriangles;

test('patches have equal parts of their triangle', () => {
  const areas = patchAreas(TRIANGLES, 5, null);
  [2, 1.5, 1.5, 1.5, 1.5].forEach((area, patch) => {
    expect(areas[patch]).toBeCloseTo(area, 6);
  });
});

test('of a patch counts what the plan counts of it, in every area', () => {
  const areas = patchAreas(TRIANGLES, 5, Uint8Array.of(255, 51, 0, 255, 255));
  expect([...areas]).toEqual([2, expect.closeTo(0.3), 0, 1.5, 1.5]);
  const seen = Uint8Array.of(1, 0, 255, 1, 0);
  const element = { firstTriangle: 0, nTriangles: 2 } as unknown as StageElement;
  const { achievableM2, seenM2 } = coverageOf(element, TRIANGLES, seen, areas);
  expect([achievableM2, seenM2]).toEqual([expect.closeTo(5.3), expect.closeTo(3.5)]);
});

test('a spread counts surface, not patches, and leaves out what has no value', () => {
  const spread = spreadOf(
    Uint16Array.of(1000, 2000, 3000, 9000),
    RANGE,
    Float32Array.of(6, 2, 1, 1),
    new Uint8Array(4),
  );
  expect(spread.median).toBeCloseTo(1);
  expect(spread.mostly).toBeCloseTo(9);
  expect(spread).toMatchObject({ low: 0, high: 9 });
  const some = spreadOf(
    Uint16Array.of(1000, 2000, 3000, 9000),
    RANGE,
    Float32Array.of(6, 2, 1, 1),
    Uint8Array.of(NOT_ASKED, 1, 1, NOT_ASKED),
  );
  expect(some.median).toBeCloseTo(2);
  expect(some.mostly).toBeCloseTo(3);
  const none = spreadOf(Uint16Array.of(65535, 65535), RANGE, Float32Array.of(1, 1), new Uint8Array(2));
  expect(none).toMatchObject({ median: null, mostly: null });
  expect(none.high).toBeGreaterThan(0);
});

test.each([
  [0.0413, 0.05],
  [1, 1],
  [1.01, 1.2],
  [4.63, 5],
  [97, 100],
  [0, 1],
])('%f rounds up to %f', (value, expected) => {
  expect(roundUp(value)).toBeCloseTo(expected, 9);
});

test.each([
  [0.0061, 'm', undefined, '6.1 mm'],
  [0.00004, 'm', undefined, '0.04 mm'],
  [4.632, 'm', undefined, '4.63 m'],
  [12.345, 'm', undefined, '12.3 m'],
  [0, 'm', 5, '0 m'],
  [0.025, 'm', 0.05, '25 mm'],
  [36.6, 'deg', undefined, '37°'],
  [250, 'ms', undefined, '250 ms'],
])('%f %s (beside %s) is written %s', (value, unit, beside, words) => {
  expect(quantity(value, unit, beside ?? value)).toBe(words);
});

test('marks are those of the bits, little endian in each byte', () => {
  const [a, b] = [Uint8Array.of(0b0000_0101, 0b1), Uint8Array.of(0b0000_0110, 0b1)];
  expect([0, 1, 2, 8, 9].map((patch) => isSeen(a, patch))).toEqual([true, false, true, true, false]);
  expect([...sharedMarks(a, b, 10)]).toEqual([0, 0, 1, 0, 0, 0, 0, 0, 1, 0]);
  const times = Uint8Array.of(1, 1, 2, 0, 0, 0, 0, 0, 1, 255);
  const marks = ownMarks(a, times);
  expect([...marks]).toEqual([1, 0, 0, 0, 0, 0, 0, 0, 1, 0]);
  expect(markedArea(marks, new Float32Array(10).fill(0.5))).toBe(1);
});

test('a piece is the patches that bear its name, and none that have none', () => {
  const pieces = Int32Array.of(-1, 4, 4, 2, 4, -1);
  expect([...pieceMarks(pieces, 4)]).toEqual([0, 1, 1, 0, 1, 0]);
  expect([...pieceMarks(pieces, 2)]).toEqual([0, 0, 0, 1, 0, 0]);
});

test('the coverage of an element is that of its own patches', () => {
  const areas = patchAreas(TRIANGLES, 5, null);
  const element = {
    sceneIndex: 0,
    name: '',
    kind: '',
    sourceId: '',
    floorId: '',
    file: 0,
    firstTriangle: 0,
    nTriangles: 1,
  };
  const coverage = coverageOf(element, TRIANGLES, Uint8Array.of(9, 0, 1, 2, NOT_ACHIEVABLE), areas);
  expect([coverage.areaM2, coverage.askedM2]).toEqual([6, 6].map((area) => expect.closeTo(area)));
  expect(coverage.achievableM2).toBeCloseTo(4.5);
  expect(coverage.seenM2).toBeCloseTo(3);
  const some = coverageOf(element, TRIANGLES, Uint8Array.of(9, 0, 1, 2, NOT_ASKED), areas);
  expect([some.achievableM2, some.seenM2]).toEqual([coverage.achievableM2, coverage.seenM2]);
  expect([some.areaM2, some.askedM2]).toEqual([6, 4.5].map((area) => expect.closeTo(area)));
});

test('reasons that the viewer words otherwise are reasons of the planner', () => {
  const reasons = reasonsOfPlanner();
  expect(Object.keys(REASON_WORDS).filter((reason) => !reasons.includes(reason))).toEqual([]);
  expect([reasonInWords('no admissible spot'), reasonInWords('too sparse')]).toEqual([
    'no valid tripod position',
    'too sparse',
  ]);
});
