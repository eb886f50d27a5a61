/** Arrows from where stations stood to where they stand, and crosses where one is gone: lines over the building. */
import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments } from 'three';

type PointM = readonly [number, number, number];

/** Local frame, metres, lifted as they are drawn. */
export type Arrow =
  | { readonly kind: 'moved'; readonly fromM: PointM; readonly toM: PointM }
  | { readonly kind: 'new' | 'gone'; readonly atM: PointM };

const COLOURS = { moved: '#7a3fa0', new: '#2b8a9b', gone: '#c2453a' } as const;
/** Length of the two strokes of an arrow's head, at most this share of its shaft. */
const HEAD_M = 0.3;
const HEAD_SHARE = 0.4;
const HEAD_RAD = Math.PI / 7;
const CROSS_M = 0.22;

export class Arrows {
  readonly lines = (['moved', 'new', 'gone'] as const).map((kind) => {
    const material = new LineBasicMaterial({ color: COLOURS[kind], depthTest: false, transparent: true });
    const lines = new LineSegments(new BufferGeometry(), material);
    lines.frustumCulled = false;
    lines.renderOrder = 2;
    lines.name = kind;
    return lines;
  });

  set(arrows: readonly Arrow[]): void {
    for (const lines of this.lines) {
      const ends = Float32Array.from(arrows.filter(({ kind }) => kind === lines.name).flatMap(strokesOf));
      lines.geometry.dispose();
      lines.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(ends, 3));
      lines.visible = ends.length > 0;
    }
  }

  dispose(): void {
    for (const lines of this.lines) {
      lines.geometry.dispose();
      lines.material.dispose();
    }
  }
}

/** Ends of the strokes, x y z after each other. */
export function strokesOf(arrow: Arrow): number[] {
  if (arrow.kind === 'moved') return [...arrow.fromM, ...arrow.toM, ...headOf(arrow.fromM, arrow.toM)];
  const [x, y, z] = arrow.atM;
  const d = CROSS_M;
  // A plus for a new one, a cross for one that is gone.
  if (arrow.kind === 'new') return [x - d, y, z, x + d, y, z, x, y - d, z, x, y + d, z];
  return [x - d, y - d, z, x + d, y + d, z, x - d, y + d, z, x + d, y - d, z];
}

function headOf(from: PointM, to: PointM): number[] {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(dx, dy);
  if (length === 0) return [];
  const size = Math.min(HEAD_M, HEAD_SHARE * length);
  return [HEAD_RAD, -HEAD_RAD].flatMap((turn) => {
    const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
    const back = [-(dx * cos - dy * sin) / length, -(dx * sin + dy * cos) / length];
    return [...to, to[0] + size * back[0], to[1] + size * back[1], to[2]];
  });
}
