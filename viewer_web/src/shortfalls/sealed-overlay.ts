/** Ground that nobody can enter, in the building: its area filled, and what it is written on it. */
import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
} from 'three';

export interface SealedGround {
  /** Local frame, lifted as it is drawn. */
  readonly insideM: readonly [number, number, number];
  /** Lowest and highest (x, y) of rectangles, local frame. */
  readonly rectangles: readonly (readonly [readonly [number, number], readonly [number, number]])[];
  readonly words: string;
}

const RED = '#b3262e';
const FILL_OPACITY = 0.6;
/** Above the floor, so that neither hides the other. */
const ABOVE_M = 0.04;
/** Of the label in the picture, as a share of the picture's height at any distance. */
const LABEL_HEIGHT = 0.021;
const TEXELS_HIGH = 64;

export class SealedOverlay {
  readonly group = new Group();

  set(grounds: readonly SealedGround[]): void {
    this.dispose();
    for (const ground of grounds) {
      if (ground.rectangles.length > 0) this.group.add(fillOf(ground));
      const label = labelOf(ground);
      if (label !== null) this.group.add(label);
    }
  }

  dispose(): void {
    for (const child of this.group.children as (Mesh<BufferGeometry, MeshBasicMaterial> | Sprite)[]) {
      child.material.map?.dispose();
      child.material.dispose();
      // All sprites share one geometry.
      if (child instanceof Mesh) child.geometry.dispose();
    }
    this.group.clear();
  }
}

function fillOf({ insideM, rectangles }: SealedGround): Mesh {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(cornersOf(rectangles, insideM[2] + ABOVE_M), 3));
  const look = { color: RED, transparent: true, opacity: FILL_OPACITY, side: DoubleSide, depthWrite: false };
  const mesh = new Mesh(geometry, new MeshBasicMaterial(look));
  mesh.renderOrder = 1;
  return mesh;
}

/** Two triangles for each rectangle, (2 K, 9). */
export function cornersOf(rectangles: SealedGround['rectangles'], heightM: number): Float32Array {
  return Float32Array.from(
    rectangles.flatMap(([[x0, y0], [x1, y1]]) =>
      [
        [x0, y0],
        [x1, y0],
        [x1, y1],
        [x0, y0],
        [x1, y1],
        [x0, y1],
      ].flatMap(([x, y]) => [x, y, heightM]),
    ),
  );
}

/** Words beside the dot of an area; null where there is nothing to write with. */
function labelOf({ insideM: [x, y, z], words }: SealedGround): Sprite | null {
  if (typeof document === 'undefined') return null;
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d');
  if (context === null) return null;
  const font = `600 ${0.56 * TEXELS_HIGH}px system-ui, sans-serif`;
  context.font = font;
  [canvas.width, canvas.height] = [Math.ceil(context.measureText(words).width + 0.6 * TEXELS_HIGH), TEXELS_HIGH];
  context.fillStyle = RED;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = '#fff';
  context.font = font;
  context.textBaseline = 'middle';
  context.fillText(words, 0.3 * TEXELS_HIGH, 0.52 * TEXELS_HIGH);
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map, sizeAttenuation: false, depthTest: false }));
  sprite.scale.set((LABEL_HEIGHT * canvas.width) / canvas.height, LABEL_HEIGHT, 1);
  sprite.center.set(0.5, -0.7);
  sprite.position.set(x, y, z);
  sprite.renderOrder = 3;
  return sprite;
}
