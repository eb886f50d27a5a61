/** What of the building lies under places of the page and of the picture: rays against what is drawn. */
import { type Ray, Vector3 } from 'three';
import { sliceOfFloor, WHOLE_BUILDING } from '../floors/cut.ts';
import { NOT_ACHIEVABLE, NOT_ASKED } from '../heat/layers.ts';
import type { PatchPaint } from '../heat/patch-paint.ts';
import { triangleArea } from '../heat/statistics.ts';
import { normalOf } from '../load/edges.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { patchCode } from '../load/patch-rule.ts';
import type { StageTriangles } from '../load/stage.ts';
import type { Store } from '../store.ts';
import type { IsPassed, SurfaceHit, SurfacePicker } from './pick.ts';
import type { Picked } from './state.ts';
import type { Viewport } from './viewport.ts';
import { weightsAt } from './weights.ts';

/** Nothing this near to a station hides it: it may stand against a table it was planned beside. */
const OCCLUSION_SLACK_M = 0.15;

/** So many places across and down tell what is in the picture. */
const SIGHT_STEPS = 9;

export class DrawnSurfaces {
  constructor(
    private readonly store: Store,
    private readonly loaded: LoadedPlan,
    private readonly viewport: Viewport,
    private readonly picker: SurfacePicker,
    private readonly isHidden: IsPassed,
    private readonly patchPaint: PatchPaint,
  ) {}

  /** The surface under a place of the page; null: none. */
  surfaceAt(clientX: number, clientY: number): Picked | null {
    const ray = this.viewport.rayAt(clientX, clientY);
    const hit = this.first(ray);
    return hit === null ? null : this.describe(hit, ray.direction);
  }

  /** An element as if the largest of its triangles was clicked from in front. */
  surfaceOf(elementIndex: number): Picked {
    const { triangles, elements } = this.loaded.stage;
    const { firstTriangle, nTriangles, floorId } = elements[elementIndex];
    const all = [...Array(nTriangles).keys()].map((i) => firstTriangle + i);
    const areaOf = (triangle: number): number => triangleArea(triangles.squaredEdgesM2, 3 * triangle);
    const triangle = all.reduce((best, one) => (areaOf(one) > areaOf(best) ? one : best), firstTriangle);
    const corners = triangles.cornersM.subarray(9 * triangle, 9 * triangle + 9);
    const middle = [0, 1, 2].map((k) => (corners[k] + corners[k + 3] + corners[k + 6]) / 3);
    const inwards = -this.loaded.edges.bodySide[triangle];
    const beam = new Vector3(...normalOf(triangles.cornersM, triangle)).multiplyScalar(inwards);
    const slice = sliceOfFloor(this.store.slices.peek(), floorId) ?? WHOLE_BUILDING;
    return this.describe({ triangle, pointM: new Vector3(...middle), distanceM: 0, slice }, beam);
  }

  /** What one can stand on under a place of the page; local frame. */
  groundAt(clientX: number, clientY: number): [number, number, number] | null {
    const hit = this.first(this.viewport.rayAt(clientX, clientY));
    if (hit === null) return null;
    const [nx, ny, nz] = normalOf(this.loaded.stage.triangles.cornersM, hit.triangle);
    const isLevel = Math.abs(nz) > 0.8 * Math.hypot(nx, ny, nz);
    return isLevel ? [hit.pointM.x, hit.pointM.y, hit.pointM.z] : null;
  }

  /** Of surfaces on a grid over the picture, local frame. */
  placesInSight(): [number, number, number][] {
    const { left, top, width, height } = this.viewport.box();
    const steps = [...Array(SIGHT_STEPS).keys()].map((i) => (i + 0.5) / SIGHT_STEPS);
    return steps.flatMap((y) =>
      steps.flatMap((x) => {
        const hit = this.first(this.viewport.rayAt(left + x * width, top + y * height));
        return hit === null ? [] : [hit.pointM.toArray()];
      }),
    );
  }

  /** The surface between the camera and a place; null: none. */
  coverOf(at: Vector3): SurfaceHit | null {
    const { ray, distanceM } = this.viewport.rayTo(at);
    return this.first(ray, distanceM - OCCLUSION_SLACK_M);
  }

  private first(ray: Ray, farM = Number.POSITIVE_INFINITY): SurfaceHit | null {
    return this.picker.firstHit(ray, this.store.slices.peek(), farM, this.isHidden);
  }

  private describe(hit: SurfaceHit, beam: Vector3): Picked {
    const { triangles, elements, floors, offsetM } = this.loaded.stage;
    const elementIndex = triangles.element[hit.triangle];
    const patch = patchAt(triangles, hit);
    const seen = this.patchPaint.timesSeen[patch];
    const outward = new Vector3(...normalOf(triangles.cornersM, hit.triangle));
    const isSection = this.loaded.edges.bodySide[hit.triangle] * outward.dot(beam) > 0;
    return {
      element: elements[elementIndex],
      elementIndex,
      triangle: hit.triangle,
      patch,
      groundOf: floors.find(({ index }) => index + 1 === triangles.groundOf[hit.triangle])?.id ?? null,
      timesSeen: seen === NOT_ACHIEVABLE || seen === NOT_ASKED || isSection ? null : seen,
      isAsked: seen !== NOT_ASKED,
      isSection,
      drawnOn: hit.slice.floorId,
      pointM: [hit.pointM.x + offsetM[0], hit.pointM.y + offsetM[1], hit.pointM.z + offsetM[2]],
    };
  }
}

/** The patch that a ray met. */
export function patchAt(triangles: StageTriangles, { triangle, pointM }: SurfaceHit): number {
  const weights = weightsAt(triangles.cornersM, triangle, pointM);
  const [q01, q12, q20] = triangles.squaredEdgesM2.subarray(3 * triangle, 3 * triangle + 3);
  return triangles.firstPatch[triangle] + patchCode(weights, [q01, q12, q20], triangles.patchDepth[triangle]);
}
