/**
 * The building in three.js: one merged list of triangles, drawn once a slice in pieces, coloured patch by patch.
 *
 * Vertices are only positions: what belongs to a triangle is looked up in textures by gl_VertexID / 3, and the patch under
 * a fragment follows from its barycentric weights (load/patch-rule.ts). So walls of two triangles still show where they are
 * seen. A closed body that a slice cuts open shows the back of its faces: they are painted as the section.
 */
import {
  BackSide,
  type BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  FloatType,
  FrontSide,
  GLSL3,
  GreaterDepth,
  Group,
  IntType,
  LineSegments,
  Mesh,
  RGBAFormat,
  RGIntegerFormat,
  ShaderMaterial,
  UnsignedByteType,
} from 'three';
import { FLAT_COS, type Slice } from '../floors/cut.ts';
import type { PatchValues } from '../heat/layers.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { PATCH_CODE_GLSL } from '../load/patch-rule.ts';
import { type Chunk, lineChunks, reaches, surfaceChunks } from './chunks.ts';
import type { Palette } from './palette.ts';
import { PatchTexture, TEXTURE_WIDTH, textureOf } from './patch-values.ts';

/** How the building is painted; the shader knows them by number. */
const PAINT_MODES = { plain: 0, classes: 1, ramp: 2 } as const;

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
uniform int paintMode; // 0 plain, 1 classes, 2 ramp
uniform bool hasMarks;
uniform bool isGhost; // the pass that draws nothing but marked patches, through whatever hides them
uniform float rampLow, rampHigh, rampNone;
uniform bool isBack; // not gl_FrontFacing: three turns it round where it draws back faces
uniform float fade;
uniform int pickedElement;
uniform vec3 plainColor, groundColor, sectionColor, unseenColor, notAchievableColor, pickedColor, markColor, backgroundColor;
in vec3 vLocal;
in vec3 vWeights;
flat in vec3 vEdges;
flat in ivec4 vNumbers;
out vec4 fragColor;
${PATCH_CODE_GLSL}
vec3 classColor(int value) { return texelFetch(colors, ivec2(min(value, 255), 0), 0).rgb; }
vec3 rampColor(float value, ivec2 texel) {
  if (value == rampNone) return texelFetch(patchSeen, texel, 0).r == 0u ? unseenColor : notAchievableColor;
  float t = clamp((value - rampLow) / (rampHigh - rampLow), 0.0, 1.0);
  return classColor(int(t * 255.0 + 0.5));
}
vec3 surfaceColor() {
  vec3 bare = (vNumbers.w & 1) == 1 ? groundColor : plainColor;
  if (!hasMarks && (paintMode == 0 || fade > 0.0)) return bare;
  int patchId = vNumbers.x + int(patchCode(vWeights, vEdges, vNumbers.z));
  ivec2 texel = ivec2(patchId % ${TEXTURE_WIDTH}, patchId / ${TEXTURE_WIDTH});
  if (hasMarks) return texelFetch(patchMarks, texel, 0).r == 0u ? mix(bare, plainColor, 0.6) : markColor;
  int value = int(texelFetch(patchValues, texel, 0).r);
  return paintMode == 1 ? classColor(value) : rampColor(float(value), texel);
}
bool isMarked() {
  int patchId = vNumbers.x + int(patchCode(vWeights, vEdges, vNumbers.z));
  return texelFetch(patchMarks, ivec2(patchId % ${TEXTURE_WIDTH}, patchId / ${TEXTURE_WIDTH}), 0).r != 0u;
}
void main() {
  // Flat shading from the geometry itself; sign-free, since a surface's two sides look alike.
  vec3 normal = abs(normalize(cross(dFdx(vLocal), dFdy(vLocal))));
  if (vLocal.z < slice.x || vLocal.z > slice.y || (vLocal.z > slice.z && normal.z > ${FLAT_COS})) discard;
  if (isGhost) {
    if (!isMarked()) discard;
    fragColor = vec4(markColor, 0.3);
    return;
  }
  float light = 0.74 + 0.26 * normal.z - 0.10 * normal.x + 0.02 * normal.y;
  int bodySide = (vNumbers.w >> 1) - 1;
  bool isSection = bodySide != 0 && (bodySide > 0) == isBack;
  vec3 color;
  if (isSection) {
    color = hasMarks && isMarked() ? mix(sectionColor, markColor, 0.6) : sectionColor;
  } else {
    color = surfaceColor();
    if (vNumbers.y == pickedElement) color = mix(color, pickedColor, 0.45);
    color *= light;
  }
  fragColor = vec4(mix(color, backgroundColor, fade), 1.0);
}
`;

const LINE_VERTEX = /* glsl */ `
out float vHeight;
void main() {
  vHeight = position.z;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;
const LINE_FRAGMENT = /* glsl */ `
precision highp float;
uniform vec3 slice;
uniform vec3 lineColor;
uniform float opacity;
in float vHeight;
out vec4 fragColor;
void main() {
  if (vHeight < slice.x || vHeight > slice.y) discard;
  fragColor = vec4(lineColor, opacity);
}
`;

/** What the patches are painted by. */
export type Paint =
  | { readonly mode: 'plain' }
  /** `colors`: 256 colours of three bytes, by value. */
  | { readonly mode: 'classes'; readonly colors: Uint8Array }
  /** `colors` from `low` to `high`, which are values as the patches hold them. */
  | {
      readonly mode: 'ramp';
      readonly colors: Uint8Array;
      readonly low: number;
      readonly high: number;
      readonly none: number;
    };

export class Building {
  readonly group = new Group();
  private readonly surfaces: readonly Chunk[];
  private readonly lines: readonly Chunk[];
  private readonly textures: DataTexture[];
  private readonly colors = new DataTexture(new Uint8Array(4 * 256), 256, 1, RGBAFormat, UnsignedByteType);
  private readonly seen: PatchTexture;
  private readonly marks: PatchTexture;
  /** Of the layer that is shown; the one above where that is what is shown. */
  private values: PatchTexture;
  /** Shared by the materials of all slices: three reads the same objects. */
  private readonly uniforms;
  private readonly lineUniforms = { lineColor: { value: new Color() }, opacity: { value: 0.5 } };
  private materials: ShaderMaterial[] = [];
  /** Of each slice: the marked patches once more, seen through what hides them. */
  private ghosts: Mesh[] = [];

  constructor({ stage, edges, patchSeen }: LoadedPlan) {
    const { triangles } = stage;
    this.surfaces = surfaceChunks(triangles.cornersM, stage.elements);
    this.lines = lineChunks(edges.linesM);
    const shape = new Float32Array(4 * triangles.count);
    const numbers = new Int32Array(2 * triangles.count);
    for (let t = 0; t < triangles.count; t++) {
      shape.set(triangles.squaredEdgesM2.subarray(3 * t, 3 * t + 3), 4 * t);
      shape[4 * t + 3] =
        triangles.patchDepth[t] + 64 * Math.min(1, triangles.groundOf[t]) + 128 * (edges.bodySide[t] + 1);
      numbers.set([triangles.firstPatch[t], triangles.element[t]], 2 * t);
    }
    const shapeTexture = textureOf(shape, 4, RGBAFormat, FloatType, 'RGBA32F');
    const numberTexture = textureOf(numbers, 2, RGIntegerFormat, IntType, 'RG32I');
    this.textures = [shapeTexture, numberTexture, this.colors];
    this.seen = new PatchTexture(patchSeen);
    this.values = this.seen;
    this.marks = new PatchTexture(new Uint8Array(1));
    this.uniforms = {
      triangleShape: { value: shapeTexture },
      triangleNumbers: { value: numberTexture },
      patchSeen: { value: this.seen.texture },
      patchValues: { value: this.seen.texture },
      patchMarks: { value: this.marks.texture },
      colors: { value: this.colors },
      paintMode: { value: 0 as number },
      hasMarks: { value: false },
      rampLow: { value: 0 },
      rampHigh: { value: 1 },
      rampNone: { value: -1 },
      fade: { value: 0 },
      pickedElement: { value: -1 },
      plainColor: { value: new Color() },
      groundColor: { value: new Color() },
      sectionColor: { value: new Color() },
      unseenColor: { value: new Color() },
      notAchievableColor: { value: new Color() },
      pickedColor: { value: new Color() },
      markColor: { value: new Color() },
      backgroundColor: { value: new Color() },
    };
  }

  setPalette(palette: Palette): void {
    const u = this.uniforms;
    setColor(u.plainColor.value, palette.plain);
    setColor(u.groundColor.value, palette.ground);
    setColor(u.sectionColor.value, palette.section);
    setColor(u.unseenColor.value, palette.unseen);
    setColor(u.notAchievableColor.value, palette.notAchievable);
    setColor(u.pickedColor.value, palette.picked);
    setColor(u.backgroundColor.value, palette.background);
    setColor(u.markColor.value, palette.mark);
    setColor(this.lineUniforms.lineColor.value, palette.line);
  }

  setPaint(paint: Paint): void {
    const u = this.uniforms;
    u.paintMode.value = PAINT_MODES[paint.mode];
    if (paint.mode === 'plain') return;
    const texels = this.colors.image.data as Uint8Array;
    for (let i = 0; i < 256; i++) texels.set([...paint.colors.subarray(3 * i, 3 * i + 3), 255], 4 * i);
    this.colors.needsUpdate = true;
    if (paint.mode === 'classes') return;
    u.rampLow.value = paint.low;
    u.rampHigh.value = Math.max(paint.high, paint.low + 1e-6);
    u.rampNone.value = paint.none;
  }

  setPicked(elementIndex: number | null): void {
    this.uniforms.pickedElement.value = elementIndex ?? -1;
  }

  /** Step back behind a cloud. */
  setFaded(isFaded: boolean): void {
    this.uniforms.fade.value = isFaded ? 0.25 : 0;
    this.lineUniforms.opacity.value = isFaded ? 0.3 : 0.5;
  }

  setTimesSeen(timesSeen: Uint8Array): void {
    this.seen.set(timesSeen);
    this.bindPatches();
  }

  /** Values of the layer that is shown; null: those are how many stations see a patch. */
  setValues(values: PatchValues | null): void {
    if (values === null) {
      if (this.values !== this.seen) this.values.dispose();
      this.values = this.seen;
    } else if (this.values === this.seen) {
      this.values = new PatchTexture(values);
    } else {
      this.values.set(values);
    }
    this.bindPatches();
  }

  /** Change the values of some patches. */
  patch(indices: ArrayLike<number>, timesSeen: ArrayLike<number> | null, values: ArrayLike<number> | null): void {
    if (timesSeen !== null) this.seen.patch(indices, timesSeen);
    if (values !== null && this.values !== this.seen) this.values.patch(indices, values);
  }

  /** Show only the patches whose mark is not 0, the rest in the colours of bare surface; null: no marks. */
  setMarks(marks: Uint8Array | null): void {
    this.uniforms.hasMarks.value = marks !== null;
    for (const ghost of this.ghosts) ghost.visible = marks !== null;
    // Give the memory back: marks are a passing thing.
    this.marks.set(marks ?? new Uint8Array(1));
    this.bindPatches();
  }

  setSlices(slices: readonly Slice[]): void {
    this.disposeSlices();
    for (const slice of slices) {
      const limits = {
        value: [slice.bottomM, slice.topM, slice.ceilingM].map((z) => Math.min(1e9, Math.max(-1e9, z))),
      };
      // Lines lie in the surfaces they outline, so surfaces step back; front faces further than back faces: where two bodies
      // touch, the section of one must win over the face of the other.
      const surfaces = [FrontSide, BackSide].map(
        (side, i) =>
          new ShaderMaterial({
            glslVersion: GLSL3,
            vertexShader: SURFACE_VERTEX,
            fragmentShader: SURFACE_FRAGMENT,
            uniforms: {
              ...this.uniforms,
              slice: limits,
              isBack: { value: side === BackSide },
              isGhost: { value: false },
              firstTriangle: { value: 0 },
            },
            side,
            polygonOffset: true,
            polygonOffsetFactor: 1,
            polygonOffsetUnits: 3 - 2 * i,
          }),
      );
      const line = new ShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: LINE_VERTEX,
        fragmentShader: LINE_FRAGMENT,
        uniforms: { ...this.lineUniforms, slice: limits },
        transparent: true,
      });
      const ghost = new ShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: SURFACE_VERTEX,
        fragmentShader: SURFACE_FRAGMENT,
        uniforms: {
          ...this.uniforms,
          slice: limits,
          isBack: { value: false },
          isGhost: { value: true },
          firstTriangle: { value: 0 },
        },
        side: DoubleSide,
        transparent: true,
        depthFunc: GreaterDepth,
        depthWrite: false,
      });
      this.materials.push(...surfaces, line, ghost);
      const meshes = this.surfaces
        .filter((chunk) => reaches(chunk, slice))
        .flatMap((chunk) => [...surfaces, ghost].map((material) => pieceOf(chunk, material)));
      for (const mesh of meshes.filter(({ material }) => material === ghost)) {
        mesh.visible = this.uniforms.hasMarks.value;
        this.ghosts.push(mesh);
      }
      const lines = this.lines
        .filter((chunk) => reaches(chunk, slice))
        .map(({ geometry }) => new LineSegments(geometry, line));
      for (const object of [...meshes, ...lines]) {
        object.position.z = slice.liftM;
        this.group.add(object);
      }
    }
    // What no slice reaches gives its graphics memory back; it is filled again when a slice does.
    for (const chunk of [...this.surfaces, ...this.lines]) {
      if (!slices.some((slice) => reaches(chunk, slice))) chunk.geometry.dispose();
    }
  }

  dispose(): void {
    this.disposeSlices();
    for (const { geometry } of [...this.surfaces, ...this.lines]) geometry.dispose();
    for (const texture of this.textures) texture.dispose();
    for (const texture of new Set([this.seen, this.values, this.marks])) texture.dispose();
  }

  private bindPatches(): void {
    this.uniforms.patchSeen.value = this.seen.texture;
    this.uniforms.patchValues.value = this.values.texture;
    this.uniforms.patchMarks.value = this.marks.texture;
  }

  private disposeSlices(): void {
    this.group.clear();
    for (const material of this.materials) material.dispose();
    this.materials = [];
    this.ghosts = [];
  }
}

/** A piece with a material that others share: what is its own is set right before it is drawn. */
function pieceOf({ geometry, firstTriangle }: Chunk, material: ShaderMaterial): Mesh<BufferGeometry, ShaderMaterial> {
  const mesh = new Mesh(geometry, material);
  mesh.onBeforeRender = () => {
    material.uniforms.firstTriangle.value = firstTriangle;
    material.uniformsNeedUpdate = true;
  };
  return mesh;
}

/** The shaders write what is on screen, so colours pass as they are written, not as linear light. */
export function setColor(color: Color, css: string): void {
  const number = Number.parseInt(css.slice(1), 16);
  color.r = (number >> 16) / 255;
  color.g = ((number >> 8) & 255) / 255;
  color.b = (number & 255) / 255;
}
