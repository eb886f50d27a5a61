/**
 * What a stage needs before it can be drawn and picked: read, its edges found, its triangles in a search tree.
 *
 * Bytes to plain data that passes between threads: `stage-worker.ts` does it beside the page.
 */
import { BufferAttribute, BufferGeometry } from 'three';
import { MeshBVH, type SerializedBVH } from 'three-mesh-bvh';
import { findEdges, type StageEdges } from './edges.ts';
import { readStage, type Stage } from './stage.ts';

export interface PreparedStage {
  readonly stage: Stage;
  readonly edges: StageEdges;
  readonly tree: SerializedBVH;
}

export function prepareStage(bytes: ArrayBuffer): PreparedStage {
  const stage = readStage(bytes);
  const edges = findEdges(stage.triangles, stage.elements);
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(stage.triangles.cornersM, 3));
  // `indirect`: the triangles keep their order, since their number is their address.
  const tree = MeshBVH.serialize(new MeshBVH(geometry, { indirect: true }), { cloneBuffers: false });
  return { stage, edges, tree };
}

/** What of it is handed over to another thread rather than copied. */
export function buffersOf({ stage: { triangles }, edges, tree }: PreparedStage): ArrayBuffer[] {
  const arrays = [
    triangles.cornersM,
    triangles.squaredEdgesM2,
    triangles.element,
    triangles.firstPatch,
    triangles.patchDepth,
    triangles.groundOf,
    edges.linesM,
    edges.firstLine,
    edges.bodySide,
    ...(tree.indirectBuffer === null ? [] : [tree.indirectBuffer]),
  ];
  return [...new Set([...arrays.map(({ buffer }) => buffer as ArrayBuffer), ...tree.roots])];
}
