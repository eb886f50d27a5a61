/**
 * The building in three.js: one merged geometry, drawn once a slice, coloured patch by patch.
 *
 * Vertices are only positions: what belongs to a triangle is looked up in textures by gl_VertexID / 3, and the patch under
 * a fragment follows from its barycentric weights (load/patch-rule.ts). So walls of two triangles still show where they are
 * seen. A closed body that a slice cuts open shows the back of its faces: they are painted as the section.
 */
import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  FloatType,
  FrontSide,
  GLSL3,
  Group,
  IntType,
  LineSegments,
  Mesh,
  NearestFilter,
  type PixelFormat,
  RedIntegerFormat,
  RGBAFormat,
  RGIntegerFormat,
  ShaderMaterial,
  type TextureDataType,
  UnsignedByteType,
} from 'three';
import type { Slice } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { PATCH_CODE_GLSL } from '../load/patch-rule.ts';
import type { Paint } from '../store.ts';
import type { Palette } from './palette.ts';

/** Narrow enough for every WebGL 2 implementation. */
const TEXTURE_WIDTH = 2048;
/** Never a byte of patches.u8 for a patch some candidate sees. */
export const NOT_ACHIEVABLE = 255;

const SURFACE_VERTEX = /* glsl */ `
uniform highp sampler2D triangleShape;   // squared edges 01, 12, 20; depth + 64 * (is ground) + 128 * (body side + 1)
uniform highp isampler2D triangleNumbers; // first patch, element
out vec3 vLocal;
out vec3 vWeights;
flat out vec3 vEdges;
flat out ivec4 vNumbers; // first patch, element, depth, flags
void main() {
  int triangle = gl_VertexID / 3;
  int corner = gl_VertexID - 3 * triangle;
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
uniform highp usampler2D patchSeen;
uniform vec2 slice;
uniform bool paintsCoverage;
uniform bool isBack; // not gl_FrontFacing: three turns it round where it draws back faces
uniform float fade;
uniform int pickedElement;
uniform vec3 plainColor, groundColor, sectionColor, unseenColor, notAchievableColor, pickedColor, backgroundColor;
uniform vec3 seenColor[4];
in vec3 vLocal;
in vec3 vWeights;
flat in vec3 vEdges;
flat in ivec4 vNumbers;
out vec4 fragColor;
${PATCH_CODE_GLSL}
vec3 coverageColor() {
  int patchId = vNumbers.x + int(patchCode(vWeights, vEdges, vNumbers.z));
  uint seen = texelFetch(patchSeen, ivec2(patchId % ${TEXTURE_WIDTH}, patchId / ${TEXTURE_WIDTH}), 0).r;
  if (seen == ${NOT_ACHIEVABLE}u) return notAchievableColor;
  if (seen == 0u) return unseenColor;
  return seenColor[min(int(seen), 4) - 1];
}
void main() {
  if (vLocal.z < slice.x || vLocal.z > slice.y) discard;
  // Flat shading from the geometry itself; sign-free, since a surface's two sides look alike.
  vec3 normal = abs(normalize(cross(dFdx(vLocal), dFdy(vLocal))));
  float light = 0.74 + 0.26 * normal.z - 0.10 * normal.x + 0.02 * normal.y;
  int bodySide = (vNumbers.w >> 1) - 1;
  bool isSection = bodySide != 0 && (bodySide > 0) == isBack;
  vec3 color;
  if (isSection) {
    color = sectionColor;
  } else {
    color = paintsCoverage ? coverageColor() : ((vNumbers.w & 1) == 1 ? groundColor : plainColor);
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
uniform vec2 slice;
uniform vec3 lineColor;
uniform float opacity;
in float vHeight;
out vec4 fragColor;
void main() {
  if (vHeight < slice.x || vHeight > slice.y) discard;
  fragColor = vec4(lineColor, opacity);
}
`;

export interface BuildingLook {
  readonly paint: Paint;
  readonly pickedElement: number | null;
  /** Step back behind a cloud. */
  readonly isFaded: boolean;
}

export class Building {
  readonly group = new Group();
  readonly geometry: BufferGeometry;
  private readonly lines: BufferGeometry;
  private readonly textures: DataTexture[];
  /** Shared by the materials of all slices: three reads the same objects. */
  private readonly uniforms;
  private readonly lineUniforms = { lineColor: { value: new Color() }, opacity: { value: 0.5 } };
  private materials: ShaderMaterial[] = [];

  constructor({ stage, edges, patchSeen }: LoadedPlan) {
    const { triangles } = stage;
    this.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(triangles.cornersM, 3));
    this.geometry.computeBoundingSphere();
    this.lines = new BufferGeometry().setAttribute('position', new BufferAttribute(edges.linesM, 3));
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
    const seenTexture = textureOf(patchSeen, 1, RedIntegerFormat, UnsignedByteType, 'R8UI');
    this.textures = [shapeTexture, numberTexture, seenTexture];
    this.uniforms = {
      triangleShape: { value: shapeTexture },
      triangleNumbers: { value: numberTexture },
      patchSeen: { value: seenTexture },
      paintsCoverage: { value: true },
      fade: { value: 0 },
      pickedElement: { value: -1 },
      plainColor: { value: new Color() },
      groundColor: { value: new Color() },
      sectionColor: { value: new Color() },
      unseenColor: { value: new Color() },
      notAchievableColor: { value: new Color() },
      pickedColor: { value: new Color() },
      backgroundColor: { value: new Color() },
      seenColor: { value: [0, 1, 2, 3].map(() => new Color()) },
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
    u.seenColor.value.forEach((color, i) => {
      setColor(color, palette.seen[i]);
    });
    setColor(this.lineUniforms.lineColor.value, palette.line);
  }

  setLook({ paint, pickedElement, isFaded }: BuildingLook): void {
    this.uniforms.paintsCoverage.value = paint === 'coverage' && !isFaded;
    this.uniforms.pickedElement.value = pickedElement ?? -1;
    this.uniforms.fade.value = isFaded ? 0.25 : 0;
    this.lineUniforms.opacity.value = isFaded ? 0.3 : 0.5;
  }

  setSlices(slices: readonly Slice[]): void {
    this.disposeSlices();
    for (const slice of slices) {
      const limits = { value: [slice.bottomM, slice.topM].map((z) => Math.min(1e9, Math.max(-1e9, z))) };
      // Lines lie in the surfaces they outline, so surfaces step back; front faces further than back faces: where two bodies
      // touch, the section of one must win over the face of the other.
      const surfaces = [FrontSide, BackSide].map(
        (side, i) =>
          new ShaderMaterial({
            glslVersion: GLSL3,
            vertexShader: SURFACE_VERTEX,
            fragmentShader: SURFACE_FRAGMENT,
            uniforms: { ...this.uniforms, slice: limits, isBack: { value: side === BackSide } },
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
      this.materials.push(...surfaces, line);
      const meshes = surfaces.map((surface) => new Mesh(this.geometry, surface));
      for (const object of [...meshes, new LineSegments(this.lines, line)]) {
        object.position.z = slice.liftM;
        this.group.add(object);
      }
    }
  }

  dispose(): void {
    this.disposeSlices();
    this.geometry.dispose();
    this.lines.dispose();
    for (const texture of this.textures) texture.dispose();
  }

  private disposeSlices(): void {
    this.group.clear();
    for (const material of this.materials) material.dispose();
    this.materials = [];
  }
}

/** The shaders write what is on screen, so colours pass as they are written, not as linear light. */
export function setColor(color: Color, css: string): void {
  const number = Number.parseInt(css.slice(1), 16);
  color.r = (number >> 16) / 255;
  color.g = ((number >> 8) & 255) / 255;
  color.b = (number & 255) / 255;
}

function textureOf<T extends Float32Array | Int32Array | Uint8Array>(
  values: T,
  channels: number,
  format: PixelFormat,
  type: TextureDataType,
  internalFormat: 'RGBA32F' | 'RG32I' | 'R8UI',
): DataTexture {
  const height = Math.max(1, Math.ceil(values.length / channels / TEXTURE_WIDTH));
  const padded = new (values.constructor as new (n: number) => T)(height * TEXTURE_WIDTH * channels);
  padded.set(values);
  const texture = new DataTexture(padded as never, TEXTURE_WIDTH, height, format, type);
  texture.internalFormat = internalFormat;
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}
