/** Over how much surface a layer's values spread: what the ends of its legend are, and what its middle. */
import type { StageTriangles } from '../load/stage.ts';
import { NOT_ASKED, type PatchValues, type RampLayer } from './layers.ts';

export interface Spread {
  /** Ends of the colours, in the layer's unit. */
  readonly low: number;
  readonly high: number;
  /** Half of the surface is at or below the one, 95 % at or below the other; null: no patch has a value. */
  readonly median: number | null;
  readonly mostly: number | null;
}

/** The colours run up to what this share of the surface keeps: the rest would leave no contrast to it. */
const MOSTLY = 0.95;

/**
 * Area of each patch: the 2^depth patches of a triangle have equal parts of it. `counted`: how much of each counts, in 255ths,
 * as docs/method/coverage.md says and all figures of the plan do; null: all of it.
 */
export function patchAreas(triangles: StageTriangles, nPatches: number, counted: Uint8Array | null): Float32Array {
  const areas = new Float32Array(nPatches);
  for (let t = 0; t < triangles.count; t++) {
    const n = 2 ** triangles.patchDepth[t];
    const first = triangles.firstPatch[t];
    areas.fill(triangleArea(triangles.squaredEdgesM2, 3 * t) / n, first, first + n);
  }
  counted?.forEach((part, patch) => {
    areas[patch] *= part / 255;
  });
  return areas;
}

/** Heron's formula in squared edges; 0 where rounding makes it negative. */
export function triangleArea(squaredEdges: ArrayLike<number>, at: number): number {
  const [a, b, c] = [squaredEdges[at], squaredEdges[at + 1], squaredEdges[at + 2]];
  return Math.sqrt(Math.max(0, 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c))) / 4;
}

/** Colours run from 0 to the round number above what most of the surface keeps; what need not be covered does not count. */
export function spreadOf(values: PatchValues, layer: RampLayer, areas: Float32Array, timesSeen: Uint8Array): Spread {
  const areaOfValue = new Float64Array(65536);
  let total = 0;
  for (let patch = 0; patch < values.length; patch++) {
    if (values[patch] === layer.none || timesSeen[patch] === NOT_ASKED) continue;
    areaOfValue[values[patch]] += areas[patch];
    total += areas[patch];
  }
  if (total === 0) return { low: 0, high: roundUp(layer.step), median: null, mostly: null };
  const quantile = (share: number): number => {
    let sum = 0;
    for (let value = 0; value < 65536; value++) {
      sum += areaOfValue[value];
      if (sum >= share * total) return value * layer.step;
    }
    return 65535 * layer.step;
  };
  const high = layer.unit === 'deg' ? 90 : roundUp(Math.max(layer.step, quantile(MOSTLY)));
  return { low: 0, high, median: quantile(0.5), mostly: quantile(MOSTLY) };
}

/** The next number of one digit, or 1.2, 1.5, 2.5, times a power of ten. */
export function roundUp(value: number): number {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9, 10].find((one) => value <= one * power * (1 + 1e-9)) ?? 10;
  return step * power;
}
