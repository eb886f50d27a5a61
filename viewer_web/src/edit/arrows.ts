/** Arrows from where stations stood to where they stand, crosses where one is gone, plus signs where one is new. */
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshBasicMaterial } from 'three';

type PointM = readonly [number, number, number];

/** Local frame, metres, lifted as they are drawn. */
export type Arrow =
  | { readonly kind: 'moved'; readonly fromM: PointM; readonly toM: PointM }
  | { readonly kind: 'new' | 'gone'; readonly atM: PointM };

export const ARROW_COLOURS = { moved: '#7a3fa0', new: '#2b8a9b', gone: '#c2453a' } as const;
const WIDTH_M = 0.09;
/** Of an arrow's head, at most this share of the way. */
const HEAD_M = 0.34;
const HEAD_SHARE = 0.5;
const CROSS_M = 0.24;

export class Arrows {
  readonly meshes = (['moved', 'new', 'gone'] as const).map((kind) => {
    const look = { color: ARROW_COLOURS[kind], depthTest: false, transparent: true, opacity: 0.9, side: DoubleSide };
    const mesh = new Mesh(new BufferGeometry(), new MeshBasicMaterial(look));
    mesh.frustumCulled = false;
    mesh.renderOrder = 2;
    mesh.name = kind;
    return mesh;
  });

  set(arrows: readonly Arrow[]): void {
    for (const mesh of this.meshes) {
      const corners = Float32Array.from(arrows.filter(({ kind }) => kind === mesh.name).flatMap(trianglesOf));
      mesh.geometry.dispose();
      mesh.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(corners, 3));
      mesh.visible = corners.length > 0;
    }
  }

  dispose(): void {
    for (const mesh of this.meshes) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}

/** Level triangles, nine numbers each. */
export function trianglesOf(arrow: Arrow): number[] {
  if (arrow.kind === 'moved') return arrowOf(arrow.fromM, arrow.toM);
  const [x, y, z] = arrow.atM;
  const d = CROSS_M;
  const strokes: [PointM, PointM][] =
    arrow.kind === 'new'
      ? [
          [
            [x - d, y, z],
            [x + d, y, z],
          ],
          [
            [x, y - d, z],
            [x, y + d, z],
          ],
        ]
      : [
          [
            [x - d, y - d, z],
            [x + d, y + d, z],
          ],
          [
            [x - d, y + d, z],
            [x + d, y - d, z],
          ],
        ];
  return strokes.flatMap(([from, to]) => barOf(from, to));
}

function arrowOf(from: PointM, to: PointM): number[] {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  // Straight up or down there is nothing to draw on the level.
  if (length === 0) return [];
  const head = Math.min(HEAD_M, HEAD_SHARE * length);
  const share = 1 - head / length;
  const neck: PointM = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), to[2]];
  const [sx, sy] = sideOf(from, to, head * 0.45);
  return [...barOf(from, neck), neck[0] + sx, neck[1] + sy, to[2], neck[0] - sx, neck[1] - sy, to[2], ...to];
}

function barOf(from: PointM, to: PointM): number[] {
  const [sx, sy] = sideOf(from, to, WIDTH_M / 2);
  const [a, b] = [
    [from[0] + sx, from[1] + sy, from[2]],
    [from[0] - sx, from[1] - sy, from[2]],
  ];
  const [c, d] = [
    [to[0] + sx, to[1] + sy, to[2]],
    [to[0] - sx, to[1] - sy, to[2]],
  ];
  return [...a, ...b, ...c, ...c, ...b, ...d];
}

/** Level, square to the way, so long. */
function sideOf(from: PointM, to: PointM, lengthM: number): [number, number] {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const scale = lengthM / Math.hypot(dx, dy);
  return [-dy * scale, dx * scale];
}
