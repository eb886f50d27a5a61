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
  Vector3,
} from 'three';
import type { Place } from './ground-map.ts';

export type AreaKind =
  | 'keep_out'
  | 'priority'
  | 'forbidden'
  | 'ground'
  | 'not_ground'
  | 'entrance'
  | 'door_open'
  | 'door_shut'
  | 'drawing';

const COLOURS: Readonly<Record<AreaKind, string>> = {
  keep_out: '#c2453a',
  priority: '#2f6fd0',
  forbidden: '#c2453a',
  ground: '#2e9e5b',
  not_ground: '#a03a8e',
  entrance: '#f5c518',
  door_open: '#2e9e5b',
  door_shut: '#8a4b20',
  drawing: '#d08a00',
};
/** Above the floor, so that neither hides the other. */
const ABOVE_M = 0.03;
const FILL_OPACITY = 0.28;
/** An entrance is small, and nothing below it is of interest. */
const ENTRANCE_OPACITY = 0.9;
/** A band along the rim of marked ground: so wide, and clearly drawn. */
const RIM_M = 0.08;
const RIM_OPACITY = 0.85;
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
  /** Of triangles only the rim is drawn. */
  readonly isRimAlone?: boolean;
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

function objectsOf({ kind, heightM, outline, cornersM, isOpen = false, isRimAlone = false }: Area): (Mesh | Line)[] {
  const color = COLOURS[kind];
  const fill = (positions: Float32Array, opacity = FILL_OPACITY): Mesh => {
    const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(positions, 3));
    const look = { color, transparent: true, opacity, side: DoubleSide, depthWrite: false };
    return new Mesh(geometry, new MeshBasicMaterial(look));
  };
  if (cornersM !== undefined) {
    const rim = fill(rimOf(cornersM), RIM_OPACITY);
    // Floors end under walls: their rims would show nowhere.
    (rim.material as MeshBasicMaterial).depthTest = false;
    return isRimAlone ? [rim] : [fill(cornersM), rim];
  }
  if (outline === undefined || outline.length === 0) return [];
  const flat = Float32Array.from(outline.flatMap(([x, y]) => [x, y, heightM]));
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(flat, 3));
  const material = new LineBasicMaterial({ color, depthTest: false, transparent: true });
  const rim = isOpen ? new Line(geometry, material) : new LineLoop(geometry, material);
  const opacity = kind === 'entrance' ? ENTRANCE_OPACITY : FILL_OPACITY;
  return isOpen ? [rim] : [fill(filled(outline, heightM), opacity), rim];
}

/** Triangles (L, 9) of a band along the edges that only one of triangles (T, 9) has, on the inner side of each. */
export function rimOf(cornersM: Float32Array): Float32Array {
  const edges = new Map<string, number[] | null>();
  for (let t = 0; t < cornersM.length; t += 9) {
    const corner = (k: number): number[] => [...cornersM.subarray(t + 3 * (k % 3), t + 3 * (k % 3) + 3)];
    for (const k of [0, 1, 2]) {
      const [a, b, c] = [corner(k), corner(k + 1), corner(k + 2)];
      const key = [a.join(' '), b.join(' ')].sort().join(' | ');
      edges.set(key, edges.has(key) ? null : [...a, ...b, ...c]);
    }
  }
  return Float32Array.from([...edges.values()].flatMap((edge) => (edge === null ? [] : bandOf(edge))));
}

/** Two triangles along the edge from `a` to `b`, on the side of `c`. */
function bandOf([ax, ay, az, bx, by, bz, cx, cy, cz]: readonly number[]): number[] {
  const [a, b, c] = [new Vector3(ax, ay, az), new Vector3(bx, by, bz), new Vector3(cx, cy, cz)];
  const along = b.clone().sub(a).normalize();
  const across = c.clone().sub(a);
  across.addScaledVector(along, -across.dot(along)).setLength(RIM_M);
  const [innerA, innerB] = [a.clone().add(across), b.clone().add(across)];
  return [a, b, innerB, a, innerB, innerA].flatMap((corner) => corner.toArray());
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
