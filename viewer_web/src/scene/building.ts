/**
 * The building in three.js: one merged list of triangles, drawn once a slice in pieces, coloured patch by patch.
 *
 * Vertices are only positions: what belongs to a triangle is looked up in textures by gl_VertexID / 3, and the patch under
 * a fragment follows from its barycentric weights (load/patch-rule.ts). So walls of two triangles still show where they are
 * seen. A closed body that a slice cuts open shows the back of its faces: they are painted as the section.
 */
import {
  type BufferGeometry,
  Color,
  DataTexture,
  FloatType,
  Group,
  IntType,
  LineSegments,
  Mesh,
  RGBAFormat,
  RGIntegerFormat,
  type ShaderMaterial,
  UnsignedByteType,
} from 'three';
import type { Slice } from '../floors/cut.ts';
import type { PatchValues } from '../heat/layers.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { type CutUniforms, cutUniforms } from '../section/cut-uniforms.ts';
import { sliceMaterials } from './building-materials.ts';
import { type Chunk, lineChunks, reaches, surfaceChunks } from './chunks.ts';
import type { Palette } from './palette.ts';
import { PatchTexture, textureOf } from './patch-values.ts';

/** How the building is painted; the shader knows them by number. */
const PAINT_MODES = { plain: 0, classes: 1, ramp: 2 } as const;

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

/** Of lines: they show the form where colours of the legend hide it, without blackening a model of many small parts. */
const LINE_OPACITY = { clear: 0.7, faded: 0.3 } as const;

/** In the texture of marks, of what a change loses and wins. */
const [LOST, WON] = [1, 2];

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
  /** What a section takes away; others that draw with the building share it. */
  readonly cut: CutUniforms = cutUniforms();
  private readonly lineUniforms = {
    ...this.cut,
    lineColor: { value: new Color() },
    opacity: { value: LINE_OPACITY.clear as number },
    /** 0 where no lines are drawn. */
    share: { value: 1 as number },
  };
  private materials: ShaderMaterial[] = [];
  /** Of each slice: the marked patches once more, seen through what hides them. */
  private ghosts: Mesh[] = [];

  private readonly nPatches: number;

  constructor({ stage, edges, patchSeen }: LoadedPlan) {
    this.nPatches = patchSeen.length;
    const { triangles } = stage;
    this.surfaces = surfaceChunks(triangles.cornersM, stage.elements);
    this.lines = lineChunks(edges, stage.elements);
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
      ...this.cut,
      triangleShape: { value: shapeTexture },
      triangleNumbers: { value: numberTexture },
      patchSeen: { value: this.seen.texture },
      patchValues: { value: this.seen.texture },
      patchMarks: { value: this.marks.texture },
      colors: { value: this.colors },
      paintMode: { value: 0 as number },
      hasMarks: { value: false },
      hasChanges: { value: false },
      lostColor: { value: new Color() },
      wonColor: { value: new Color() },
      rampLow: { value: 0 },
      rampHigh: { value: 1 },
      rampNone: { value: -1 },
      fade: { value: 0 },
      pickedElement: { value: -1 },
      isolatedElement: { value: -1 },
      isHatched: { value: false },
      plainColor: { value: new Color() },
      groundColor: { value: new Color() },
      sectionColor: { value: new Color() },
      unseenColor: { value: new Color() },
      notAchievableColor: { value: new Color() },
      notAskedColor: { value: new Color() },
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
    setColor(u.notAskedColor.value, palette.notAsked);
    setColor(u.pickedColor.value, palette.picked);
    setColor(u.backgroundColor.value, palette.background);
    setColor(u.markColor.value, palette.mark);
    setColor(u.lostColor.value, palette.lost);
    setColor(u.wonColor.value, palette.won);
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

  /** Draw the surfaces of one element alone, without lines, or with those of the others as in an x-ray; null: all. */
  setIsolated(elementIndex: number | null, isXray: boolean): void {
    this.uniforms.isolatedElement.value = elementIndex ?? -1;
    this.lineUniforms.share.value = elementIndex === null || isXray ? 1 : 0;
  }

  /** Hatch what no station sees. */
  setHatched(isHatched: boolean): void {
    this.uniforms.isHatched.value = isHatched;
  }

  /** Step back behind a cloud. */
  setFaded(isFaded: boolean): void {
    this.uniforms.fade.value = isFaded ? 0.25 : 0;
    this.lineUniforms.opacity.value = isFaded ? LINE_OPACITY.faded : LINE_OPACITY.clear;
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
    this.uniforms.hasChanges.value = false;
    for (const ghost of this.ghosts) ghost.visible = marks !== null;
    // Give the memory back: marks are a passing thing.
    this.marks.set(marks ?? new Uint8Array(1));
    this.bindPatches();
  }

  /** Paint what a change loses and wins over the layer, patches; null: nothing. What is marked stays in the picture instead. */
  setChanges(change: { readonly lost: readonly number[]; readonly won: readonly number[] } | null): void {
    if (this.uniforms.hasMarks.value || (change === null && !this.uniforms.hasChanges.value)) return;
    this.uniforms.hasChanges.value = change !== null;
    const painted = new Uint8Array(change === null ? 1 : this.nPatches);
    for (const patch of change?.lost ?? []) painted[patch] = LOST;
    for (const patch of change?.won ?? []) painted[patch] = WON;
    this.marks.set(painted);
    this.bindPatches();
  }

  /** `hiddenFiles`: numbers of files of which nothing is drawn. */
  setSlices(slices: readonly Slice[], hiddenFiles: ReadonlySet<number> = new Set()): void {
    this.disposeSlices();
    const isDrawn = (chunk: Chunk, slice: Slice): boolean => !hiddenFiles.has(chunk.file) && reaches(chunk, slice);
    for (const slice of slices) {
      const { surfaces, line, ghost } = sliceMaterials(slice, this.uniforms, this.lineUniforms);
      this.materials.push(...surfaces, line, ghost);
      const meshes = this.surfaces
        .filter((chunk) => isDrawn(chunk, slice))
        .flatMap((chunk) => [...surfaces, ghost].map((material) => pieceOf(chunk, material)));
      for (const mesh of meshes.filter(({ material }) => material === ghost)) {
        mesh.visible = this.uniforms.hasMarks.value;
        this.ghosts.push(mesh);
      }
      const lines = this.lines
        .filter((chunk) => isDrawn(chunk, slice))
        .map(({ geometry }) => new LineSegments(geometry, line));
      for (const object of [...meshes, ...lines]) {
        object.position.z = slice.liftM;
        this.group.add(object);
      }
    }
    // What is not drawn gives its graphics memory back; it is filled again when it is.
    for (const chunk of [...this.surfaces, ...this.lines]) {
      if (!slices.some((slice) => isDrawn(chunk, slice))) chunk.geometry.dispose();
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
