/**
 * Which place a pointer means: the corner or edge that is near to it in the picture, else the surface under it.
 *
 * Edges are those that are drawn, and where a cut opens walls, the line in which it meets them; corners are the ends of drawn edges, and where a cut ends one. What is hidden is
 * not snapped to.
 */
import { Line3, Ray, Vector3 } from 'three';
import type { Slice } from '../floors/cut.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { keptOfRay } from '../section/planes.ts';
import type { IsPassed, SurfaceHit, SurfacePicker } from './pick.ts';

export interface Snapped {
  readonly kind: 'corner' | 'edge' | 'surface';
  /** Local frame, not lifted. */
  readonly pointM: Vector3;
  readonly slice: Slice;
  /** What was hit there or beside it. */
  readonly triangle: number;
}

/** The picture, as far as snapping needs it. */
export interface Picture {
  rayAt(clientX: number, clientY: number): Ray;
  rayTo(place: Vector3): { readonly ray: Ray; readonly distanceM: number };
  project(place: Vector3): { readonly x: number; readonly y: number } | null;
  metresPerPixel(place: Vector3): number;
}

/** So near to the pointer a corner is meant, or an edge; corners are ends of edges, so they reach further. */
const CORNER_PIXELS = 12;
const EDGE_PIXELS = 8;
/** Beside a corner the pointer is on nothing, or on what lies far behind: it is looked for around. */
const AROUND = [
  [0, 0],
  [9, 0],
  [-9, 0],
  [0, 9],
  [0, -9],
] as const;
/** A place is not hidden by what lies so little in front of it. */
const SLACK_M = 0.02;
/** Of elements of more edges, as terrain, only the surface is snapped to. */
const MOST_EDGES = 20_000;
/** What is steeper than this a level cut opens along a line. */
const STEEP_COS = 0.7;

interface Candidate extends Snapped {
  readonly pixels: number;
}

export class Snapper {
  constructor(
    private readonly picker: SurfacePicker,
    private readonly loaded: Pick<LoadedPlan, 'stage' | 'edges'>,
    private readonly isHidden: IsPassed,
  ) {}

  snapAt(clientX: number, clientY: number, picture: Picture, slices: readonly Slice[]): Snapped | null {
    const pointerRay = picture.rayAt(clientX, clientY);
    const under = this.picker.firstHit(pointerRay, slices, undefined, this.isHidden);
    const candidates: Candidate[] = [];
    const searched = new Set<string>();
    for (const [dx, dy] of AROUND) {
      const ray = picture.rayAt(clientX + dx, clientY + dy);
      const hit = this.picker.firstHit(ray, slices, undefined, this.isHidden);
      // As far off as what was hit, so surely in the picture.
      const pointer = hit && picture.project(pointerRay.at(hit.distanceM, new Vector3()));
      if (pointer) this.collect(hit, pointer, pointerRay, picture, searched, candidates);
    }
    const rank = ({ kind, pixels }: Candidate): number => pixels + (kind === 'corner' ? 0 : CORNER_PIXELS);
    candidates.sort((a, b) => rank(a) - rank(b));
    for (const { pixels: _, ...snapped } of candidates) {
      if (this.isInSight(snapped, picture, slices)) return snapped;
    }
    return under && { kind: 'surface', pointM: under.pointM, slice: under.slice, triangle: under.triangle };
  }

  private collect(
    { pointM, slice, triangle }: SurfaceHit,
    pointer: { readonly x: number; readonly y: number },
    pointerRay: Ray,
    picture: Picture,
    searched: Set<string>,
    into: Candidate[],
  ): void {
    const lowered = new Ray(pointerRay.origin.clone().setZ(pointerRay.origin.z - slice.liftM), pointerRay.direction);
    const lift = (p: Vector3): Vector3 => p.clone().setZ(p.z + slice.liftM);
    const offer = (kind: 'corner' | 'edge', at: Vector3): void => {
      const place = picture.project(lift(at));
      const pixels = place === null ? Number.POSITIVE_INFINITY : Math.hypot(place.x - pointer.x, place.y - pointer.y);
      if (pixels <= (kind === 'corner' ? CORNER_PIXELS : EDGE_PIXELS)) {
        into.push({ kind, pointM: at, slice, triangle, pixels });
      }
    };
    const radiusM = 2 * CORNER_PIXELS * picture.metresPerPixel(lift(pointM));
    const near = this.picker.trianglesNear(pointM, radiusM).filter((t) => !this.isHidden(t));
    for (const line of this.edgesOf(near, slice, searched)) {
      offer('corner', line.start);
      offer('corner', line.end);
      offer('edge', nearestOnLine(lowered, line));
    }
    for (const t of near) {
      const line = this.openedBy(slice, t);
      if (line !== null) offer('edge', nearestOnLine(lowered, line));
    }
  }

  /** Drawn edges of the elements that triangles are of, as far as the slice shows them; each element once for each slice. */
  private edgesOf(near: readonly number[], slice: Slice, searched: Set<string>): Line3[] {
    const { stage, edges } = this.loaded;
    const found: Line3[] = [];
    for (const element of new Set(near.map((t) => stage.triangles.element[t]))) {
      const key = `${element} ${slice.floorId}`;
      const [first, end] = [edges.firstLine[element], edges.firstLine[element + 1]];
      if (searched.has(key) || end - first > MOST_EDGES) continue;
      searched.add(key);
      for (let i = first; i < end; i++) {
        const line = new Line3(
          new Vector3().fromArray(edges.linesM, 6 * i),
          new Vector3().fromArray(edges.linesM, 6 * i + 3),
        );
        const shown = shownOf(line, slice);
        if (shown !== null) found.push(shown);
      }
    }
    return found;
  }

  /** Where the top of a slice cuts a steep triangle; null: it does not. */
  private openedBy(slice: Slice, triangle: number): Line3 | null {
    const { cornersM } = this.loaded.stage.triangles;
    const corners = [0, 3, 6].map((k) => new Vector3().fromArray(cornersM, 9 * triangle + k));
    const normal = corners[1].clone().sub(corners[0]).cross(corners[2].clone().sub(corners[0])).normalize();
    if (Math.abs(normal.z) > STEEP_COS) return null;
    const ends: Vector3[] = [];
    for (const [a, b] of [
      [0, 1],
      [1, 2],
      [2, 0],
    ]) {
      const [from, to] = [corners[a], corners[b]];
      if (from.z > slice.topM === to.z > slice.topM) continue;
      ends.push(from.clone().lerp(to, (slice.topM - from.z) / (to.z - from.z)));
    }
    return ends.length === 2 ? shownOf(new Line3(ends[0], ends[1]), slice) : null;
  }

  private isInSight({ pointM, slice }: Snapped, picture: Picture, slices: readonly Slice[]): boolean {
    const { ray, distanceM } = picture.rayTo(pointM.clone().setZ(pointM.z + slice.liftM));
    return this.picker.firstHit(ray, slices, distanceM - SLACK_M, this.isHidden) === null;
  }
}

/** The part of a line that a slice shows; null: none. */
export function shownOf(line: Line3, slice: Slice): Line3 | null {
  const way = line.delta(new Vector3());
  const lengthM = way.length();
  if (lengthM === 0) return null;
  const levels = [
    { normal: [0, 0, 1] as const, offsetM: -slice.bottomM },
    { normal: [0, 0, -1] as const, offsetM: slice.topM },
  ].filter(({ offsetM }) => Number.isFinite(offsetM));
  const planes = [...levels, ...(slice.planes ?? [])];
  const kept = keptOfRay(planes, line.start.toArray(), way.divideScalar(lengthM).toArray(), 0, lengthM);
  if (kept === null) return null;
  return new Line3(line.at(kept[0] / lengthM, new Vector3()), line.at(kept[1] / lengthM, new Vector3()));
}

/** The place on a line that is nearest to a ray; its upper end where the ray runs along it. */
export function nearestOnLine({ origin, direction }: Ray, line: Line3): Vector3 {
  const way = line.delta(new Vector3());
  const off = line.start.clone().sub(origin);
  const [ww, wd] = [way.dot(way), way.dot(direction)];
  const across = ww - wd * wd;
  if (across < 1e-9 * ww) return (line.start.z > line.end.z ? line.start : line.end).clone();
  const share = (wd * off.dot(direction) - way.dot(off)) / across;
  return line.at(Math.min(1, Math.max(0, share)), new Vector3());
}
