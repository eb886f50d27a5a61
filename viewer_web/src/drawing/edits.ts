/** Corrections of a drawn building: each takes one and returns another, which the server takes as it is. */
import type { Drawn, DrawnOpening, DrawnStorey, DrawnWall } from '../api/documents.ts';
import {
  alongAndBeside,
  type Corner,
  type Corners,
  direction,
  distance,
  isInside,
  minus,
  moved,
  openingIn,
  outlineOf,
  plus,
  rounded,
  type Straight,
  spotInside,
  straightOf,
  straightOfOpening,
} from './geometry.ts';

export type Kind = 'wall' | 'opening';
export interface Chosen {
  readonly kind: Kind;
  readonly id: string;
}

/** Shorter walls are slips of the hand. */
export const LEAST_WALL_M = 0.05;
export const LEAST_OPENING_M = 0.2;
const BESIDE_M = 0.05;

type Pair = [number, number];
const pairs = (outline: Corners): Pair[] => outline.map(([x, y]) => rounded([x, y]) as Pair);

export function withStorey(drawn: Drawn, number: number, changes: Partial<DrawnStorey>): Drawn {
  const storeys = drawn.storeys.map((storey, i) => (i === number ? { ...storey, ...changes } : storey));
  return { ...drawn, storeys };
}

/** An id that none of them has: after the highest number. */
export function newId(letter: string, elements: readonly { readonly id: string }[]): string {
  const numbers = elements.map(({ id }) => Number(id.replace(/^\D+/, '')) || 0);
  return `${letter}${Math.max(0, ...numbers) + 1}`;
}

// ------------------------------------------------------------------------------------------------ walls
export function addWall(drawn: Drawn, number: number, straight: Straight): { drawn: Drawn; id: string } | null {
  if (distance(straight.a, straight.b) < LEAST_WALL_M) return null;
  const { walls } = drawn.storeys[number];
  const id = newId('W', walls);
  const wall: DrawnWall = { id, outline: pairs(outlineOf(straight)), holes: [] };
  return { drawn: withStorey(drawn, number, { walls: [...walls, wall] }), id };
}

/** The straight wall that a door or a window is in; null: there is none. */
export function hostOf(storey: DrawnStorey, corners: Corners): { wall: DrawnWall; straight: Straight } | null {
  const opening = straightOfOpening(corners);
  const at: Corner = [(opening.a[0] + opening.b[0]) / 2, (opening.a[1] + opening.b[1]) / 2];
  return hostAt(storey, at, opening);
}

/** The straight wall at a point, that which runs with `like` first. */
export function hostAt(
  storey: DrawnStorey,
  at: Corner,
  like: Straight | null = null,
  withinM = BESIDE_M,
): { wall: DrawnWall; straight: Straight } | null {
  const found = storey.walls.flatMap((wall) => {
    const straight = straightOf(wall.outline);
    if (straight === null) return [];
    const [along, beside] = alongAndBeside(straight, at);
    const isOver = along >= -withinM && along <= distance(straight.a, straight.b) + withinM;
    return isOver && Math.abs(beside) <= straight.thicknessM / 2 + withinM
      ? [{ wall, straight, beside: Math.abs(beside) }]
      : [];
  });
  const ways = (one: Straight): number => {
    const [a, b] = [direction(one.a, one.b), like === null ? null : direction(like.a, like.b)];
    return a === null || b === null ? 0 : 1 - Math.abs(a[0] * b[0] + a[1] * b[1]);
  };
  found.sort((a, b) => ways(a.straight) - ways(b.straight) || a.beside - b.beside);
  return found[0] ?? null;
}

/** Doors and windows in a wall, each with where it is along it. */
function openingsIn(storey: DrawnStorey, wall: DrawnWall): readonly DrawnOpening[] {
  return storey.openings.filter(
    (opening) => opening.kind !== 'passage' && hostOf(storey, opening.corners)?.wall.id === wall.id,
  );
}

/** A wall shifted, with the doors and windows in it. */
export function shiftWall(drawn: Drawn, number: number, id: string, by: Corner): Drawn {
  const storey = drawn.storeys[number];
  const wall = storey.walls.find((one) => one.id === id);
  if (wall === undefined) return drawn;
  const inIt = new Set(openingsIn(storey, wall));
  const shift = (corners: Corners): Pair[] => pairs(moved(corners, by));
  return withStorey(drawn, number, {
    walls: storey.walls.map((one) =>
      one === wall ? { ...one, outline: shift(one.outline), holes: one.holes.map(shift) } : one,
    ),
    openings: storey.openings.map((one) => (inIt.has(one) ? withCorners(one, moved(one.corners, by)) : one)),
  });
}

/**
 * A straight wall with other ends or another thickness. Its doors and windows stay where they are along it, as far as they still fit;
 * null: one does not, or the wall has no length.
 */
export function reshapeWall(drawn: Drawn, number: number, id: string, to: Straight): Drawn | null {
  const storey = drawn.storeys[number];
  const wall = storey.walls.find((one) => one.id === id);
  const before = wall === undefined ? null : straightOf(wall.outline);
  if (wall === undefined || before === null || distance(to.a, to.b) < LEAST_WALL_M) return null;
  // Where the first end moved along the wall, places along it count from there.
  const along = direction(before.a, before.b) ?? [1, 0];
  const shiftM =
    distance(before.b, to.b) < 1e-9 ? alongAndBeside({ a: before.a, b: plus(before.a, along) }, to.a)[0] : 0;
  const openings = new Map<DrawnOpening, DrawnOpening>();
  for (const opening of openingsIn(storey, wall)) {
    const place = straightOfOpening(opening.corners);
    const widthM = distance(place.a, place.b);
    const at: Corner = [(place.a[0] + place.b[0]) / 2, (place.a[1] + place.b[1]) / 2];
    const corners = openingIn(to, alongAndBeside(before, at)[0] - shiftM, widthM);
    if (corners === null) return null;
    openings.set(opening, withCorners(opening, corners));
  }
  return withStorey(drawn, number, {
    walls: storey.walls.map((one) => (one === wall ? { ...one, outline: pairs(outlineOf(to)), holes: [] } : one)),
    openings: storey.openings.map((one) => openings.get(one) ?? one),
  });
}

// --------------------------------------------------------------------------------------------- openings
function withCorners(opening: DrawnOpening, corners: Corners): DrawnOpening {
  return { ...opening, corners: pairs(corners) as [Pair, Pair, Pair, Pair] };
}

/** A door or a window at a point; null: no straight wall there, or one that is shorter. */
export function addOpening(
  drawn: Drawn,
  number: number,
  kind: 'door' | 'window',
  at: Corner,
  widthM: number,
  withinM: number,
): { drawn: Drawn; id: string } | null {
  const storey = drawn.storeys[number];
  const host = hostAt(storey, at, null, withinM);
  const corners = host === null ? null : openingIn(host.straight, alongAndBeside(host.straight, at)[0], widthM);
  if (corners === null) return null;
  const id = newId('O', storey.openings);
  const opening: DrawnOpening = withCorners({ id, kind, name: '', doubtful: false } as DrawnOpening, corners);
  return { drawn: withStorey(drawn, number, { openings: [...storey.openings, opening] }), id };
}

/** A door or a window moved to the wall at a point, or with another width; null: no wall there has room for it. */
export function placeOpening(drawn: Drawn, number: number, id: string, at: Corner, widthM?: number): Drawn | null {
  const storey = drawn.storeys[number];
  const opening = storey.openings.find((one) => one.id === id);
  if (opening === undefined || opening.kind === 'passage') return null;
  const place = straightOfOpening(opening.corners);
  const width = widthM ?? distance(place.a, place.b);
  const host = hostAt(storey, at, place, 0.3);
  if (host === null || width < LEAST_OPENING_M) return null;
  const corners = openingIn(host.straight, alongAndBeside(host.straight, at)[0], width);
  return corners === null ? null : withOpening(drawn, number, withCorners(opening, corners));
}

export function middleOf(corners: Corners): Corner {
  const { a, b } = straightOfOpening(corners);
  return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
}

function withOpening(drawn: Drawn, number: number, opening: DrawnOpening): Drawn {
  const { openings } = drawn.storeys[number];
  return withStorey(drawn, number, { openings: openings.map((one) => (one.id === opening.id ? opening : one)) });
}

/** What an opening is: of a passage, which has no wall under it, a wall is made first. */
export function turnOpening(drawn: Drawn, number: number, id: string, to: 'door' | 'window' | 'passage'): Drawn {
  const storey = drawn.storeys[number];
  const opening = storey.openings.find((one) => one.id === id);
  if (opening === undefined) return drawn;
  const turned = { ...opening, kind: to, doubtful: false };
  if (to === 'passage' || hostOf(storey, opening.corners) !== null) return withOpening(drawn, number, turned);
  const under: DrawnWall = { id: newId('W', storey.walls), outline: pairs(opening.corners), holes: [] };
  return withOpening(withStorey(drawn, number, { walls: [...storey.walls, under] }), number, turned);
}

/** A wall in place of a passage, or the wall that a door or window is in without it. */
export function closeOpening(drawn: Drawn, number: number, id: string): Drawn {
  const storey = drawn.storeys[number];
  const opening = storey.openings.find((one) => one.id === id);
  if (opening === undefined) return drawn;
  const openings = storey.openings.filter((one) => one !== opening);
  if (hostOf(storey, opening.corners) !== null) return withStorey(drawn, number, { openings });
  const wall: DrawnWall = { id: newId('W', storey.walls), outline: pairs(opening.corners), holes: [] };
  return withStorey(drawn, number, { openings, walls: [...storey.walls, wall] });
}

/** Without a wall, and without the doors and windows in it; or without an opening. */
export function remove(drawn: Drawn, number: number, { kind, id }: Chosen): Drawn {
  const storey = drawn.storeys[number];
  if (kind === 'opening')
    return withStorey(drawn, number, { openings: storey.openings.filter((one) => one.id !== id) });
  const wall = storey.walls.find((one) => one.id === id);
  if (wall === undefined) return drawn;
  const inIt = new Set(openingsIn(storey, wall));
  return withStorey(drawn, number, {
    walls: storey.walls.filter((one) => one !== wall),
    openings: storey.openings.filter((one) => !inIt.has(one)),
  });
}

// ----------------------------------------------------------------------------------------- the whole
/** All storeys enlarged about the origin: what two points of the drawing are apart is `trueM`. Null: by no sound factor. */
export function rescaled(drawn: Drawn, [p, q]: readonly [Corner, Corner], trueM: number): Drawn | null {
  const by = trueM / distance(p, q);
  if (!(by >= 1e-3 && by <= 1e3)) return null;
  const scaled = (corners: Corners): Pair[] => pairs(corners.map(([x, y]) => [by * x, by * y] as const));
  const one = (corner: Corner): Pair => scaled([corner])[0];
  return {
    ...drawn,
    scale: drawn.scale * by,
    storeys: drawn.storeys.map((storey) => ({
      ...storey,
      walls: storey.walls.map((wall) => ({ ...wall, outline: scaled(wall.outline), holes: wall.holes.map(scaled) })),
      openings: storey.openings.map((opening) => withCorners(opening, scaled(opening.corners))),
      texts: storey.texts.map((text) => ({ ...text, at: one(text.at) })),
      stairs: storey.stairs.map((stair) => ({
        ...stair,
        foot: one(stair.foot),
        run_m: by * stair.run_m,
        width_m: by * stair.width_m,
      })),
    })),
  };
}

/** North is from one point to another; null: they are one. */
export function withNorth(drawn: Drawn, from: Corner, to: Corner): Drawn | null {
  const [x, y] = minus(to, from);
  if (Math.hypot(x, y) < 1e-6) return null;
  return { ...drawn, north_deg: Math.round((Math.atan2(x, y) * 180e4) / Math.PI) / 1e4 };
}

/** A room with another name: of the texts that lie in it one is left, with the words. */
export function nameRoom(drawn: Drawn, number: number, outline: Corners, words: string): Drawn {
  const others = drawn.storeys[number].texts.filter(({ at }) => !isInside(outline, at));
  const name = words.trim().slice(0, 500);
  const own = name === '' ? [] : [{ text: name, at: rounded(spotInside(outline)) as Pair }];
  return withStorey(drawn, number, { texts: [...others, ...own] });
}

/** A storey's floor at another elevation; those above it keep their distance. */
export function raiseFloor(drawn: Drawn, number: number, elevationM: number): Drawn {
  const byM = elevationM - drawn.storeys[number].elevation_m;
  return { ...drawn, storeys: drawn.storeys.map((one, i) => (i < number ? one : raised(one, byM))) };
}

/** Walls of another height; storeys above are raised by as much. */
export function raiseCeiling(drawn: Drawn, number: number, heightM: number): Drawn {
  const byM = heightM - drawn.storeys[number].room_height_m;
  return {
    ...drawn,
    storeys: drawn.storeys.map((one, i) => {
      if (i < number) return one;
      return i === number ? { ...one, room_height_m: heightM } : raised(one, byM);
    }),
  };
}

const raised = (storey: DrawnStorey, byM: number): DrawnStorey => ({
  ...storey,
  elevation_m: Math.round((storey.elevation_m + byM) * 1e4) / 1e4,
});
