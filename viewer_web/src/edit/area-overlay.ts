/** What reviewers drew on the floors: zones, forbidden places, marked ground, and the outline that is being drawn. */
import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Group,
  Line,
  LineBasicMaterial,
  LineLoop,
  Mesh,
  MeshBasicMaterial,
  ShapeUtils,
  Vector2,
} from 'three';
import type { Place } from './ground-map.ts';

export type AreaKind = 'keep_out' | 'priority' | 'forbidden' | 'ground' | 'not_ground' | 'drawing';

const COLOURS: Readonly<Record<AreaKind, string>> = {
  keep_out: '#c2453a',
  priority: '#2f6fd0',
  forbidden: '#c2453a',
  ground: '#2e9e5b',
  not_ground: '#a03a8e',
  drawing: '#d08a00',
};
/** Above the floor, so that neither hides the other. */
const ABOVE_M = 0.03;
const FILL_OPACITY = 0.28;
const CIRCLE_CORNERS = 40;

/** An area on a floor: an outline in plan, or triangles; local frame, `heightM` the floor's. */
export interface Area {
  readonly kind: AreaKind;
  readonly floorId: string;
  readonly heightM: number;
  readonly outline?: readonly Place[];
  readonly cornersM?: Float32Array;
  /** Still being drawn: not closed. */
  readonly isOpen?: boolean;
}

export class AreaOverlay {
  readonly group = new Group();

  /** Draw these and nothing else; `liftOf` is null where a floor is not shown. */
  set(areas: readonly Area[], liftOf: (floorId: string) => number | null): void {
    this.clear();
    for (const area of areas) {
      const lift = liftOf(area.floorId);
      if (lift === null) continue;
      for (const object of objectsOf(area)) {
        object.position.z = lift + ABOVE_M;
        object.renderOrder = 1;
        this.group.add(object);
      }
    }
  }

  dispose(): void {
    this.clear();
  }

  private clear(): void {
    for (const child of this.group.children) {
      const drawn = child as Mesh<BufferGeometry, MeshBasicMaterial>;
      drawn.geometry.dispose();
      drawn.material.dispose();
    }
    this.group.clear();
  }
}

function objectsOf({ kind, heightM, outline, cornersM, isOpen = false }: Area): (Mesh | Line)[] {
  const color = COLOURS[kind];
  const fill = (positions: Float32Array): Mesh => {
    const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(positions, 3));
    const look = { color, transparent: true, opacity: FILL_OPACITY, side: DoubleSide, depthWrite: false };
    return new Mesh(geometry, new MeshBasicMaterial(look));
  };
  if (cornersM !== undefined) return [fill(cornersM)];
  if (outline === undefined || outline.length === 0) return [];
  const flat = Float32Array.from(outline.flatMap(([x, y]) => [x, y, heightM]));
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(flat, 3));
  const material = new LineBasicMaterial({ color, depthTest: false, transparent: true });
  const rim = isOpen ? new Line(geometry, material) : new LineLoop(geometry, material);
  return isOpen ? [rim] : [fill(filled(outline, heightM)), rim];
}

/** Triangles (T, 9) that fill an outline at a height. */
export function filled(outline: readonly Place[], heightM: number): Float32Array {
  const faces = ShapeUtils.triangulateShape(
    outline.map(([x, y]) => new Vector2(x, y)),
    [],
  );
  return Float32Array.from(
    faces.flatMap((face) => face.flatMap((corner) => [outline[corner][0], outline[corner][1], heightM])),
  );
}

/** A circle as an outline. */
export function circle([x, y]: Place, radiusM: number): Place[] {
  return Array.from({ length: CIRCLE_CORNERS }, (_, i) => {
    const angle = (2 * Math.PI * i) / CIRCLE_CORNERS;
    return [x + radiusM * Math.cos(angle), y + radiusM * Math.sin(angle)];
  });
}
