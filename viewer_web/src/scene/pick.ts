/** Which surface lies under the pointer: a ray against the merged triangles, through the slices that are drawn. */
import { BufferAttribute, BufferGeometry, DoubleSide, Ray, Sphere, Vector3 } from 'three';
import { MeshBVH, type SerializedBVH } from 'three-mesh-bvh';
import { FLAT_COS, type Slice } from '../floors/cut.ts';
import { keptOfRay } from '../section/planes.ts';

/** Whether a ray goes on behind a triangle. */
export type IsPassed = (triangle: number) => boolean;

/** Layers of ceilings, roofs, doors and hidden files that a ray is followed through. */
const MOST_PASSED = 500;

export interface SurfaceHit {
  readonly triangle: number;
  /** Local frame, the lift of the slice taken off. */
  readonly pointM: Vector3;
  readonly distanceM: number;
  readonly slice: Slice;
}

export class SurfacePicker {
  private readonly bvh: MeshBVH;

  /** `cornersM`: the merged triangles; `tree`: theirs, see load/prepare-stage.ts. */
  constructor(cornersM: Float32Array, tree: SerializedBVH) {
    const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(cornersM, 3));
    this.bvh = MeshBVH.deserialize(tree, geometry, { setIndex: false });
  }

  /** The first surface that `ray` meets in any slice, as drawn; null: none. */
  firstHit(
    ray: Ray,
    slices: readonly Slice[],
    farM = Number.POSITIVE_INFINITY,
    isPassed: IsPassed = () => false,
  ): SurfaceHit | null {
    let best: SurfaceHit | null = null;
    for (const slice of slices) {
      const lowered = new Ray(ray.origin.clone().setZ(ray.origin.z - slice.liftM), ray.direction);
      const hit = this.firstInSlice(lowered, slice, best?.distanceM ?? farM, isPassed);
      if (hit !== null) best = hit;
    }
    return best;
  }

  /** Triangles that come as near to a place as this; local frame, metres. */
  trianglesNear(pointM: Vector3, radiusM: number): number[] {
    const near = new Sphere(pointM, radiusM);
    const found: number[] = [];
    this.bvh.shapecast({
      intersectsBounds: (box) => near.intersectsBox(box),
      intersectsTriangle: (triangle, index) => {
        if (triangle.closestPointToPoint(pointM, new Vector3()).distanceTo(pointM) <= radiusM) found.push(index);
        return false;
      },
    });
    return found;
  }

  private firstInSlice(ray: Ray, slice: Slice, farM: number, isPassed: IsPassed): SurfaceHit | null {
    // Start where the ray enters the slice, and from there on look past nothing: what it meets before is cut away.
    const up = ray.direction.z;
    const toBottom = (slice.bottomM - ray.origin.z) / up;
    const toTop = (slice.topM - ray.origin.z) / up;
    const isLevel = Math.abs(up) < 1e-9;
    if (isLevel && (ray.origin.z < slice.bottomM || ray.origin.z > slice.topM)) return null;
    const near = isLevel ? 0 : Math.max(0, Math.min(toBottom, toTop));
    const far = isLevel ? farM : Math.min(farM, Math.max(toBottom, toTop));
    if (!(near < far)) return null;
    const kept = keptOfRay(slice.planes ?? [], ray.origin.toArray(), ray.direction.toArray(), near, far);
    return kept === null ? null : this.firstDrawn(ray, slice, kept[0], kept[1], isPassed);
  }

  /** Past ceilings that are not drawn, and past what the caller passes. */
  private firstDrawn(ray: Ray, slice: Slice, near: number, far: number, isPassed: IsPassed): SurfaceHit | null {
    let from = near;
    for (let nPassed = 0; nPassed < MOST_PASSED; nPassed++) {
      const hit = this.bvh.raycastFirst(ray, DoubleSide, from, far);
      if (hit?.faceIndex === null || hit?.faceIndex === undefined) return null;
      const isHidden = hit.point.z > slice.ceilingM && Math.abs(hit.face?.normal.z ?? 0) > FLAT_COS;
      if (!isHidden && !isPassed(hit.faceIndex)) {
        return { triangle: hit.faceIndex, pointM: new Vector3().copy(hit.point), distanceM: hit.distance, slice };
      }
      from = hit.distance + 1e-4;
    }
    return null;
  }
}
