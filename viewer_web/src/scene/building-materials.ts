/** Shaders and materials of the building: of its surfaces, of what shows through them, and of its lines. */
import {
  BackSide,
  CustomBlending,
  DoubleSide,
  FrontSide,
  GLSL3,
  GreaterDepth,
  type IUniform,
  OneFactor,
  ShaderMaterial,
  ZeroFactor,
} from 'three';
import { FLAT_COS, type Slice } from '../floors/cut.ts';
import { NOT_ASKED } from '../heat/layers.ts';
import { PATCH_CODE_GLSL } from '../load/patch-rule.ts';
import { CUT_GLSL } from '../section/cut-uniforms.ts';
import { TEXTURE_WIDTH } from './patch-values.ts';

/** How much darker than level faces others are at most: bare ones, and those that have a colour of the legend. */
const BARE_SHADING = 0.36;
/** Hardly: lines show the form there, and shaded as bare ones are, walls seen by two stations look like seen by three. */
export const CLASS_SHADING = 0.06;

/** From line to line of a hatching, pixels of the picture; a third of it is line. */
const HATCH_PIXELS = 10;

const SURFACE_VERTEX = /* glsl */ `
uniform highp sampler2D triangleShape;   // squared edges 01, 12, 20; depth + 64 * (is ground) + 128 * (body side + 1)
uniform highp isampler2D triangleNumbers; // first patch, element
uniform int firstTriangle; // of the piece that is drawn
out vec3 vLocal;
out vec3 vWeights;
flat out vec3 vEdges;
flat out ivec4 vNumbers; // first patch, element, depth, flags
void main() {
  int inPiece = gl_VertexID / 3;
  int corner = gl_VertexID - 3 * inPiece;
  int triangle = firstTriangle + inPiece;
  ivec2 texel = ivec2(triangle % ${TEXTURE_WIDTH}, triangle / ${TEXTURE_WIDTH});
  vec4 shape = texelFetch(triangleShape, texel, 0);
  int flags = int(shape.w);
  vEdges = shape.xyz;
  vNumbers = ivec4(texelFetch(triangleNumbers, texel, 0).xy, flags & 63, flags >> 6);
  vWeights = vec3(corner == 0, corner == 1, corner == 2);
  vLocal = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;

const SURFACE_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
uniform highp usampler2D patchSeen, patchValues, patchMarks;
uniform sampler2D colors; // 256 texels: of each class, or along the ramp
uniform vec3 slice; // lowest, highest, and the height above which nothing flat is drawn
${CUT_GLSL}
uniform int paintMode; // 0 plain, 1 classes, 2 ramp
uniform bool hasMarks;
uniform bool hasChanges; // patchMarks has what a change loses (1) and wins (2), painted over the layer
uniform bool isHatched; // what no station sees
uniform bool isGhost; // the pass that draws nothing but marked patches, through whatever hides them
uniform float rampLow, rampHigh, rampNone;
uniform bool isBack; // not gl_FrontFacing: three turns it round where it draws back faces
uniform float fade;
uniform int pickedElement;
uniform int isolatedElement; // -1: all are drawn
uniform vec3 plainColor, groundColor, sectionColor, unseenColor, notAchievableColor, notAskedColor, pickedColor, markColor, lostColor, wonColor, backgroundColor;
in vec3 vLocal;
in vec3 vWeights;
flat in vec3 vEdges;
flat in ivec4 vNumbers;
out vec4 fragColor;
${PATCH_CODE_GLSL}
vec3 classColor(int value) { return texelFetch(colors, ivec2(min(value, 255), 0), 0).rgb; }
vec3 rampColor(float value, ivec2 texel) {
  uint seen = texelFetch(patchSeen, texel, 0).r;
  if (seen == ${NOT_ASKED}u) return notAskedColor;
  if (value == rampNone) return seen == 0u ? unseenColor : notAchievableColor;
  float t = clamp((value - rampLow) / (rampHigh - rampLow), 0.0, 1.0);
  return classColor(int(t * 255.0 + 0.5));
}
vec3 hatched(vec3 color) {
  float across = fract((gl_FragCoord.x + gl_FragCoord.y) / ${HATCH_PIXELS.toFixed(1)});
  return mix(color, sectionColor, 0.7 * (1.0 - smoothstep(0.12, 0.22, abs(across - 0.5))));
}
bool isBare() { return !hasMarks && (paintMode == 0 || fade > 0.0); }
vec3 surfaceColor() {
  vec3 bare = (vNumbers.w & 1) == 1 ? groundColor : plainColor;
  if (isBare() && !hasChanges) return bare;
  int patchId = vNumbers.x + int(patchCode(vWeights, vEdges, vNumbers.z));
  ivec2 texel = ivec2(patchId % ${TEXTURE_WIDTH}, patchId / ${TEXTURE_WIDTH});
  if (hasMarks) return texelFetch(patchMarks, texel, 0).r == 0u ? mix(bare, plainColor, 0.6) : markColor;
  if (hasChanges) {
    uint change = texelFetch(patchMarks, texel, 0).r;
    if (change != 0u) return change == 1u ? lostColor : wonColor;
    if (isBare()) return bare;
  }
  int value = int(texelFetch(patchValues, texel, 0).r);
  vec3 color = paintMode == 1 ? classColor(value) : rampColor(float(value), texel);
  return isHatched && texelFetch(patchSeen, texel, 0).r == 0u ? hatched(color) : color;
}
bool isMarked() {
  int patchId = vNumbers.x + int(patchCode(vWeights, vEdges, vNumbers.z));
  return texelFetch(patchMarks, ivec2(patchId % ${TEXTURE_WIDTH}, patchId / ${TEXTURE_WIDTH}), 0).r != 0u;
}
void main() {
  // Flat shading from the geometry itself; sign-free, since a surface's two sides look alike.
  vec3 normal = abs(normalize(cross(dFdx(vLocal), dFdy(vLocal))));
  // Along a cut a pixel is covered in part. What ends there reaches half a pixel over it: two slices that meet leave no gap.
  float kept = min(keptM(vLocal), min(vLocal.z - slice.x, slice.y - vLocal.z));
  float covered = clamp(kept / max(fwidth(kept), 1e-6) + 1.0, 0.0, 1.0);
  if (covered == 0.0 || (vLocal.z > slice.z && normal.z > ${FLAT_COS})) discard;
  if (isolatedElement >= 0 && vNumbers.y != isolatedElement) discard;
  if (isGhost) {
    if (!isMarked()) discard;
    if (kept < 0.0) discard;
    fragColor = vec4(markColor, 0.3);
    return;
  }
  float shade = max(0.0, 0.72 - 0.72 * normal.z + 0.28 * normal.x - 0.06 * normal.y); // 0 level ... 1 across x
  int bodySide = (vNumbers.w >> 1) - 1;
  bool isSection = bodySide != 0 && (bodySide > 0) == isBack;
  vec3 color;
  if (isSection) {
    color = hasMarks && isMarked() ? mix(sectionColor, markColor, 0.6) : sectionColor;
  } else {
    color = surfaceColor();
    if (vNumbers.y == pickedElement) color = mix(color, pickedColor, 0.45);
    color *= 1.0 - shade * (isBare() || hasMarks ? ${BARE_SHADING} : ${CLASS_SHADING});
  }
  fragColor = vec4(mix(color, backgroundColor, fade), covered);
}
`;

const LINE_VERTEX = /* glsl */ `
out vec3 vLocal;
void main() {
  vLocal = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;
const LINE_FRAGMENT = /* glsl */ `
precision highp float;
uniform vec3 slice;
uniform vec3 lineColor;
uniform float opacity, share;
in vec3 vLocal;
out vec4 fragColor;
${CUT_GLSL}
void main() {
  if (share == 0.0 || isCutAway(vLocal) || vLocal.z < slice.x || vLocal.z > slice.y) discard;
  fragColor = vec4(lineColor, opacity);
}
`;

type Uniforms = Readonly<Record<string, IUniform>>;

export interface SliceMaterials {
  /** Front faces, back faces. */
  readonly surfaces: readonly ShaderMaterial[];
  /** Marked patches once more, through what hides them. */
  readonly ghost: ShaderMaterial;
  readonly line: ShaderMaterial;
}

/** Materials that draw a slice; uniforms of the building are shared by all slices. */
export function sliceMaterials(slice: Slice, building: Uniforms, lines: Uniforms): SliceMaterials {
  const heights = [slice.bottomM, slice.topM, slice.ceilingM].map((z) => Math.min(1e9, Math.max(-1e9, z)));
  const limits = { value: heights };
  const surface = (isBack: boolean, isGhost: boolean): ShaderMaterial =>
    new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: SURFACE_VERTEX,
      fragmentShader: SURFACE_FRAGMENT,
      uniforms: {
        ...building,
        slice: limits,
        isBack: { value: isBack },
        isGhost: { value: isGhost },
        firstTriangle: { value: 0 },
      },
    });
  // Lines lie in the surfaces they outline, so surfaces step back; front faces further than back faces: where two bodies
  // touch, the section of one must win over the face of the other.
  const surfaces = [FrontSide, BackSide].map((side, i) =>
    Object.assign(surface(side === BackSide, false), {
      side,
      alphaToCoverage: true,
      // The coverage of a pixel is none of the picture's own.
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: ZeroFactor,
      blendSrcAlpha: ZeroFactor,
      blendDstAlpha: OneFactor,
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 3 - 2 * i,
    }),
  );
  const ghost = Object.assign(surface(false, true), {
    side: DoubleSide,
    transparent: true,
    depthFunc: GreaterDepth,
    depthWrite: false,
  });
  const line = new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: LINE_VERTEX,
    fragmentShader: LINE_FRAGMENT,
    uniforms: { ...lines, slice: limits },
    transparent: true,
  });
  return { surfaces, ghost, line };
}
