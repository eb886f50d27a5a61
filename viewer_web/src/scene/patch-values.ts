/**
 * The values of all patches as textures that the building is painted from: how many stations see each, the values of the
 * layer that is shown, and which patches are marked.
 */
import {
  DataTexture,
  type IntType,
  NearestFilter,
  type PixelFormat,
  RedIntegerFormat,
  type TextureDataType,
  UnsignedByteType,
  UnsignedShortType,
} from 'three';
import type { PatchValues } from '../heat/layers.ts';

/** Narrow enough for every WebGL 2 implementation. */
export const TEXTURE_WIDTH = 2048;

export class PatchTexture {
  texture: DataTexture;

  constructor(values: PatchValues) {
    this.texture = patchTexture(values);
  }

  /** Replace all values; their type may change. */
  set(values: PatchValues): void {
    const held = this.texture.image.data as PatchValues;
    if (held.constructor === values.constructor && held.length === paddedLength(values.length)) {
      held.set(values as never);
      this.texture.needsUpdate = true;
      return;
    }
    this.texture.dispose();
    this.texture = patchTexture(values);
  }

  /** Change some values. */
  patch(indices: ArrayLike<number>, values: ArrayLike<number>): void {
    const held = this.texture.image.data as PatchValues;
    for (let i = 0; i < indices.length; i++) held[indices[i]] = values[i];
    this.texture.needsUpdate = true;
  }

  dispose(): void {
    this.texture.dispose();
  }
}

function patchTexture(values: PatchValues): DataTexture {
  return values instanceof Uint8Array
    ? textureOf(values, 1, RedIntegerFormat, UnsignedByteType, 'R8UI')
    : textureOf(values, 1, RedIntegerFormat, UnsignedShortType, 'R16UI');
}

function paddedLength(nTexels: number): number {
  return Math.max(1, Math.ceil(nTexels / TEXTURE_WIDTH)) * TEXTURE_WIDTH;
}

/** `values` row by row in a texture of `TEXTURE_WIDTH`, filled up with zeros. */
export function textureOf<T extends Float32Array | Int32Array | Uint8Array | Uint16Array>(
  values: T,
  channels: number,
  format: PixelFormat,
  type: TextureDataType | typeof IntType,
  internalFormat: 'RGBA32F' | 'RG32I' | 'R8UI' | 'R16UI',
): DataTexture {
  const nTexels = paddedLength(values.length / channels);
  const padded = new (values.constructor as new (n: number) => T)(nTexels * channels);
  padded.set(values as never);
  const texture = new DataTexture(padded as never, TEXTURE_WIDTH, nTexels / TEXTURE_WIDTH, format, type);
  texture.internalFormat = internalFormat;
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}
