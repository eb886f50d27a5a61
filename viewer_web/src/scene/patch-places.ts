/** From patch numbers to places: which triangle a patch lies on, where its middle is, which patches lie in a box. */
import { Vector3 } from 'three';
import { normalOf } from '../load/edges.ts';
import { patchCorners } from '../load/patch-rule.ts';
import type { StageElement, StageTriangles } from '../load/stage.ts';

export class PatchPlaces {
  /** Triangles by their first patch. */
  private readonly order: Uint32Array;

  constructor(private readonly triangles: StageTriangles) {
    this.order = Uint32Array.from({ length: triangles.count }, (_, t) => t);
    this.order.sort((a, b) => triangles.firstPatch[a] - triangles.firstPatch[b]);
  }

  /** The triangle a patch is a part of; -1: none. */
  triangleOf(patch: number): number {
    const { firstPatch, patchDepth } = this.triangles;
    let [low, high] = [0, this.order.length - 1];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (firstPatch[this.order[middle]] <= patch) low = middle;
      else high = middle - 1;
    }
    const triangle = this.order[low];
    const isPart = patch >= firstPatch[triangle] && patch < firstPatch[triangle] + 2 ** patchDepth[triangle];
    return isPart ? triangle : -1;
  }

  /** Middle of a patch and unit normal of its surface, local frame. */
  placeOf(patch: number): { readonly pointM: Vector3; readonly normal: Vector3 } | null {
    const triangle = this.triangleOf(patch);
    if (triangle < 0) return null;
    return { pointM: this.middle(triangle, patch), normal: this.normal(triangle) };
  }

  /** Patches of an element for which `holds`, whose middle lies in a box (local frame, metres). */
  patchesIn(
    element: StageElement,
    [min, max]: readonly [readonly number[], readonly number[]],
    holds: (patch: number) => boolean,
  ): number[] {
    const { firstPatch, patchDepth } = this.triangles;
    const found: number[] = [];
    for (let t = element.firstTriangle; t < element.firstTriangle + element.nTriangles; t++) {
      for (let patch = firstPatch[t]; patch < firstPatch[t] + 2 ** patchDepth[t]; patch++) {
        if (!holds(patch)) continue;
        const at = this.middle(t, patch).toArray();
        if (at.every((x, k) => x >= min[k] && x <= max[k])) found.push(patch);
      }
    }
    return found;
  }

  private middle(triangle: number, patch: number): Vector3 {
    const { cornersM, squaredEdgesM2, firstPatch, patchDepth } = this.triangles;
    const [q01, q12, q20] = squaredEdgesM2.subarray(3 * triangle, 3 * triangle + 3);
    const code = patch - firstPatch[triangle];
    const c = patchCorners(cornersM, 9 * triangle, [q01, q12, q20], patchDepth[triangle], code);
    return new Vector3((c[0] + c[3] + c[6]) / 3, (c[1] + c[4] + c[7]) / 3, (c[2] + c[5] + c[8]) / 3);
  }

  private normal(triangle: number): Vector3 {
    return new Vector3(...normalOf(this.triangles.cornersM, triangle)).normalize();
  }
}
