/** How much of one element is seen. */
import type { StageElement, StageTriangles } from '../load/stage.ts';
import { NOT_ACHIEVABLE, NOT_ASKED } from './layers.ts';

export interface ElementCoverage {
  readonly areaM2: number;
  /** Of it what is to be covered. */
  readonly askedM2: number;
  readonly achievableM2: number;
  readonly seenM2: number;
}

export function coverageOf(
  { firstTriangle, nTriangles }: StageElement,
  { firstPatch, patchDepth }: StageTriangles,
  timesSeen: Uint8Array,
  areasM2: Float32Array,
): ElementCoverage {
  let [areaM2, askedM2, achievableM2, seenM2] = [0, 0, 0, 0];
  for (let t = firstTriangle; t < firstTriangle + nTriangles; t++) {
    for (let patch = firstPatch[t]; patch < firstPatch[t] + 2 ** patchDepth[t]; patch++) {
      areaM2 += areasM2[patch];
      if (timesSeen[patch] === NOT_ASKED) continue;
      askedM2 += areasM2[patch];
      if (timesSeen[patch] === NOT_ACHIEVABLE) continue;
      achievableM2 += areasM2[patch];
      if (timesSeen[patch] > 0) seenM2 += areasM2[patch];
    }
  }
  return { areaM2, askedM2, achievableM2, seenM2 };
}
