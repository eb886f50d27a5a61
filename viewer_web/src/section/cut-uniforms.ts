/** Sections in shaders: planes as uniforms that all materials share, so that dragging a box makes no material anew. */
import { Vector4 } from 'three';
import type { CutPlane } from './planes.ts';

/** Six of a box and one of a line. */
const MOST_PLANES = 7;

export interface CutUniforms {
  readonly cutPlanes: { readonly value: readonly Vector4[] };
  readonly nCutPlanes: { value: number };
}

/** `bool isCutAway(vec3 local)` and how deep it is in what is kept, `float keptM(vec3 local)`: local frame, metres. */
export const CUT_GLSL = /* glsl */ `
uniform vec4 cutPlanes[${MOST_PLANES}]; // normal and offset: kept is where normal * point + offset >= 0
uniform int nCutPlanes;
float keptM(vec3 local) {
  float depth = 1e9;
  for (int i = 0; i < nCutPlanes; i++) depth = min(depth, dot(cutPlanes[i].xyz, local) + cutPlanes[i].w);
  return depth;
}
bool isCutAway(vec3 local) { return keptM(local) < 0.0; }
`;

export function cutUniforms(): CutUniforms {
  return {
    cutPlanes: { value: Array.from({ length: MOST_PLANES }, () => new Vector4()) },
    nCutPlanes: { value: 0 },
  };
}

export function setCut({ cutPlanes, nCutPlanes }: CutUniforms, planes: readonly CutPlane[]): void {
  for (const [i, { normal, offsetM }] of planes.entries()) cutPlanes.value[i]?.set(...normal, offsetM);
  nCutPlanes.value = planes.length;
}
