/**
 * How far the walls around a station are, for setting it up with a tape or a hand-held laser: level, at the height of the instrument, square to each
 * wall. Local frame.
 */
import { Ray, Vector3 } from 'three';
import { normalOf } from '../load/edges.ts';
import type { Stage } from '../load/stage.ts';
import type { SurfaceHit } from '../scene/pick.ts';
import type { PointM } from './geometry.ts';

export interface WallDistance {
  readonly distanceM: number;
  /** Where the perpendicular meets the wall. */
  readonly footM: PointM;
  /** Name of the wall's element. */
  readonly name: string;
}

/** A surface that a ray meets. */
export interface WallHit {
  readonly pointM: Vector3;
  /** Of length 1. */
  readonly normal: Vector3;
  readonly name: string;
  /** An upright face of a wall: what a tape is held to. */
  readonly isWall: boolean;
}

export interface Surroundings {
  /** The first surface that is met within `farM`; null: none. */
  firstHit(ray: Ray, farM: number): WallHit | null;
}

const N_DIRECTIONS = 720;
/** A hand-held laser reads this far without a target plate. */
export const FARTHEST_M = 30;
const MOST_WALLS = 4;
/** A wall leans by no more. */
const UPRIGHT_SIN = 0.03;
/** The perpendicular meets the same wall: its face has this normal, at this distance. */
const SAME_COS = Math.cos((1 * Math.PI) / 180);
const SAME_M = 0.01;
/** Two walls in one direction tell one thing. */
const APART_COS = Math.cos((30 * Math.PI) / 180);
/** Distances to walls less square to each other than this hardly fix a place. */
const CROSSING_SIN = 0.5;

/** The nearest walls all around, first those two that fix the place: at most four, none where no wall is met squarely. */
export function wallsAround(fromM: PointM, { firstHit }: Surroundings): WallDistance[] {
  const origin = new Vector3(...fromM);
  const found: (WallDistance & { readonly towards: Vector3 })[] = [];
  for (let i = 0; i < N_DIRECTIONS; i++) {
    const azimuth = (2 * Math.PI * i) / N_DIRECTIONS;
    const hit = firstHit(new Ray(origin.clone(), new Vector3(Math.cos(azimuth), Math.sin(azimuth), 0)), FARTHEST_M);
    if (!hit?.isWall) continue;
    const towards = hit.normal.clone().setZ(0).normalize();
    const distanceM = hit.pointM.clone().sub(origin).dot(towards);
    if (distanceM < 0) towards.negate();
    const isKnown = found.some(
      (wall) => wall.towards.dot(towards) > SAME_COS && Math.abs(wall.distanceM - Math.abs(distanceM)) < SAME_M,
    );
    if (isKnown) continue;
    const foot = firstHit(new Ray(origin.clone(), towards), FARTHEST_M);
    if (!foot?.isWall || Math.abs(foot.normal.dot(towards)) < SAME_COS) continue;
    const measuredM = foot.pointM.distanceTo(origin);
    // Another wall stands before it: that one has its own directions.
    if (Math.abs(measuredM - Math.abs(distanceM)) > SAME_M) continue;
    const { x, y, z } = foot.pointM;
    found.push({ distanceM: measuredM, footM: [x, y, z], name: foot.name, towards });
  }
  return chosen(found).map(({ towards: _, ...wall }) => wall);
}

function chosen<T extends { readonly distanceM: number; readonly towards: Vector3 }>(found: readonly T[]): T[] {
  const nearest = [...found].sort((a, b) => a.distanceM - b.distanceM);
  const [first] = nearest;
  if (first === undefined) return [];
  const sin = ({ towards }: T): number => Math.hypot(...first.towards.clone().cross(towards).toArray());
  const crossing = nearest.find((wall) => sin(wall) >= CROSSING_SIN);
  const taken = crossing === undefined ? [first] : [first, crossing];
  for (const wall of nearest) {
    const isApart = taken.every(({ towards }) => towards.dot(wall.towards) < APART_COS);
    if (isApart && taken.length < MOST_WALLS) taken.push(wall);
  }
  return taken;
}

/** In scenes of IFC, walls and columns; in others any upright surface. */
const IS_WALL = /^Ifc(Wall|Column)/;

export function surroundingsOf(
  { triangles, elements }: Pick<Stage, 'triangles' | 'elements'>,
  cast: (ray: Ray, farM: number) => SurfaceHit | null,
): Surroundings {
  const hasWalls = elements.some(({ kind }) => IS_WALL.test(kind));
  return {
    firstHit: (ray, farM) => {
      const hit = cast(ray, farM);
      if (hit === null) return null;
      const { name, kind } = elements[triangles.element[hit.triangle]];
      const normal = new Vector3(...normalOf(triangles.cornersM, hit.triangle)).normalize();
      const isWall = Math.abs(normal.z) < UPRIGHT_SIN && (!hasWalls || IS_WALL.test(kind));
      return { pointM: hit.pointM, normal, name, isWall };
    },
  };
}
