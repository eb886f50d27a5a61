/** The cube that turns with the camera: where its faces are on the page, and what their sides are called. */
import { Vector3 } from 'three';
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { northOf } from '../measure/site.ts';
import type { PlanSide } from '../scene/camera.ts';

export interface CubeFace {
  readonly id: 'top' | 'bottom' | PlanSide;
  /** Seen from outside: what is to the right of its middle, and what is above it. */
  readonly right: Vector3;
  readonly up: Vector3;
}

const X = new Vector3(1, 0, 0);
const Y = new Vector3(0, 1, 0);
const Z = new Vector3(0, 0, 1);

export const CUBE_FACES: readonly CubeFace[] = [
  { id: 'bottom', right: X, up: Y.clone().negate() },
  { id: '-y', right: X, up: Z },
  { id: '+x', right: Y, up: Z },
  { id: '+y', right: X.clone().negate(), up: Z },
  { id: '-x', right: Y.clone().negate(), up: Z },
  { id: 'top', right: X, up: Y },
];

/** Seen at a flatter angle than this, a face is a line. */
const EDGE_ON = 0.03;

/**
 * What puts the drawing of a face, y down as on the page, where it is seen by a camera at `pose` (position and target), as
 * an SVG transform; null: it is turned away. `halfPx`: from the middle of the cube to a face.
 */
export function faceTransform({ right, up }: CubeFace, pose: readonly number[], halfPx: number): string | null {
  const { across, down, back } = axesOf(pose);
  const outward = right.clone().cross(up);
  if (outward.dot(back) < EDGE_ON) return null;
  return matrix(right, up, outward.multiplyScalar(halfPx), across, down);
}

/** The same for a level drawing below the cube, +x to the right and +y up in it. */
export function groundTransform(pose: readonly number[], halfPx: number): string {
  const { across, down } = axesOf(pose);
  return matrix(X, Y, new Vector3(0, 0, -halfPx), across, down);
}

function matrix(right: Vector3, up: Vector3, middle: Vector3, across: Vector3, down: Vector3): string {
  const below = up.clone().negate();
  const values = [right, below, middle].flatMap((one) => [one.dot(across), one.dot(down)]);
  return `matrix(${values.map((value) => value.toFixed(4)).join(' ')})`;
}

function axesOf([x, y, z, toX, toY, toZ]: readonly number[]): Record<'across' | 'down' | 'back', Vector3> {
  const back = new Vector3(x - toX, y - toY, z - toZ).normalize();
  const across = Z.clone().cross(back).normalize();
  return { across, down: across.clone().cross(back), back };
}

const TURN = { '+y': 0, '+x': 90, '-y': 180, '-x': 270 } as const;

interface SideName {
  /** On the face. */
  readonly short: string;
  readonly name: string;
}

/** What a side of the scene is called: by the nearest of eight winds where the plan has a north, else by its axis. */
export function sideName(side: PlanSide, scene: PlanJson['scene']): SideName {
  const north = northOf(scene);
  if (!north.isGiven) return { short: side.replace('-', '−'), name: side.replace('-', '−') };
  const bearing = TURN[side] - (north.rad * 180) / Math.PI;
  return winds()[(((Math.round(bearing / 45) % 8) + 8) % 8) as number];
}

const winds = (): readonly SideName[] => [
  { short: t('N'), name: t('the north') },
  { short: t('NE'), name: t('the northeast') },
  { short: t('E'), name: t('the east') },
  { short: t('SE'), name: t('the southeast') },
  { short: t('S'), name: t('the south') },
  { short: t('SW'), name: t('the southwest') },
  { short: t('W'), name: t('the west') },
  { short: t('NW'), name: t('the northwest') },
];
