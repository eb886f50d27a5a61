/** Pins, as of open comments: round dots where they are about, in front of the building. */
import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  Points,
  PointsMaterial,
  RGBAFormat,
  SRGBColorSpace,
} from 'three';

type Colour = readonly [number, number, number];
const AMBER: Colour = [208, 138, 0];
const SIZE_PIXELS = 15;
/** Texels across the picture of a dot. */
const TEXELS = 32;

export class Pins {
  readonly points: Points<BufferGeometry, PointsMaterial>;
  private readonly dot: DataTexture;

  constructor(colour: Colour = AMBER) {
    this.dot = dotTexture(colour);
    const look = { map: this.dot, size: SIZE_PIXELS, sizeAttenuation: false, depthTest: false, transparent: true };
    this.points = new Points(new BufferGeometry(), new PointsMaterial(look));
    this.points.frustumCulled = false;
    this.points.renderOrder = 3;
  }

  /** Places in the local frame, lifted as they are drawn. */
  set(placesM: readonly (readonly [number, number, number])[]): void {
    this.points.geometry.dispose();
    this.points.geometry = new BufferGeometry();
    this.points.geometry.setAttribute('position', new BufferAttribute(Float32Array.from(placesM.flat()), 3));
    this.points.visible = placesM.length > 0;
  }

  dispose(): void {
    this.points.geometry.dispose();
    this.points.material.dispose();
    this.dot.dispose();
  }
}

/** A dot with a white rim. */
function dotTexture(colour: Colour): DataTexture {
  const texels = new Uint8Array(4 * TEXELS * TEXELS);
  for (let i = 0; i < TEXELS * TEXELS; i++) {
    const radius =
      Math.hypot((i % TEXELS) - TEXELS / 2 + 0.5, Math.floor(i / TEXELS) - TEXELS / 2 + 0.5) / (TEXELS / 2);
    if (radius <= 1) texels.set([...(radius < 0.7 ? colour : [255, 255, 255]), 255], 4 * i);
  }
  const texture = new DataTexture(texels, TEXELS, TEXELS, RGBAFormat);
  // Colours as written here; without it they come out paler.
  texture.colorSpace = SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}
