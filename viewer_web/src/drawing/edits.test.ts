import { expect, test } from 'vitest';
import type { Drawn } from '../api/documents.ts';
import {
  addOpening,
  addWall,
  closeOpening,
  nameRoom,
  placeOpening,
  raiseCeiling,
  raiseFloor,
  remove,
  rescaled,
  reshapeWall,
  shiftWall,
  turnOpening,
  withNorth,
} from './edits.ts';
import { type Corners, distance, outlineOf, straightOf, straightOfOpening } from './geometry.ts';

type Pairs = [number, number][];

/** A wall along x from 0 to 5 with a door in its middle, one across at its end, and a gap between that and a third. */
const HOUSE = {
  schema: 'tlsplan:drawing:1',
  revision: 0,
  name: 'house',
  files: [{ name: 'house.dxf', sha256: '0'.repeat(64) }],
  doubtful: 'as-open',
  door_height_m: 2.1,
  sill_height_m: 0.9,
  window_head_m: 2.1,
  slab_m: 0.2,
  north_deg: null,
  scale: 1,
  storeys: [
    {
      name: 'Ground',
      elevation_m: 0,
      room_height_m: 2.8,
      traced: false,
      walls: [
        { id: 'W1', outline: box(0, 0, 5, 0.2), holes: [] },
        { id: 'W2', outline: box(5, 0, 5.2, 2), holes: [] },
        { id: 'W3', outline: box(5, 3, 5.2, 6), holes: [] },
      ],
      openings: [
        { id: 'O1', kind: 'door', corners: box(2, 0, 3, 0.2), name: '', doubtful: false },
        { id: 'O2', kind: 'passage', corners: turned(box(5, 2, 5.2, 3)), name: '', doubtful: true },
      ],
      texts: [{ text: '101', at: [2, 2] }],
      stairs: [],
    },
    {
      name: 'Upper',
      elevation_m: 3,
      room_height_m: 2.8,
      traced: false,
      walls: [],
      openings: [],
      texts: [],
      stairs: [],
    },
  ],
} as unknown as Drawn;

function box(x0: number, y0: number, x1: number, y1: number): Pairs {
  return [
    [x0, y0],
    [x1, y0],
    [x1, y1],
    [x0, y1],
  ];
}
/** The opening of a wall along y. */
function turned([a, b, c, d]: Pairs): Pairs {
  return [b, c, d, a];
}
const corners = (drawn: Drawn | null, id: string): Corners =>
  drawn?.storeys[0].openings.find((one) => one.id === id)?.corners ?? [];
const outline = (drawn: Drawn | null, id: string): Corners =>
  drawn?.storeys[0].walls.find((one) => one.id === id)?.outline ?? [];
const ids = (drawn: Drawn): readonly string[] => [
  ...drawn.storeys[0].walls.map(({ id }) => id),
  ...drawn.storeys[0].openings.map(({ id }) => id),
];

test('axis and thickness of a rectangle make the same rectangle again, at any angle', () => {
  for (const angle of [0, 0.3, 1.2, 2.9]) {
    const b: [number, number] = [1 + 3 * Math.cos(angle), 2 + 3 * Math.sin(angle)];
    const again = straightOf(outlineOf({ a: [1, 2], b, thicknessM: 0.25 }));
    expect(again?.thicknessM).toBeCloseTo(0.25, 9);
    expect(distance(again!.a, [1, 2]) + distance(again!.b, b)).toBeCloseTo(0, 9);
  }
  expect(straightOf([...box(0, 0, 1, 1), [0, 0.5]])).toBeNull();
  expect(straightOf([[0, 0], [2, 0], [3, 1], [1, 1]])).toBeNull(); // biome-ignore format: a parallelogram
});

test('a wall takes its door along, and a deleted one its door away', () => {
  const shifted = shiftWall(HOUSE, 0, 'W1', [0, 0.5]);
  expect(corners(shifted, 'O1')).toEqual(box(2, 0.5, 3, 0.7));
  expect(outline(shifted, 'W1')).toEqual(box(0, 0.5, 5, 0.7));
  expect(ids(remove(HOUSE, 0, { kind: 'wall', id: 'W1' }))).toEqual(['W2', 'W3', 'O2']);
  expect(ids(remove(HOUSE, 0, { kind: 'opening', id: 'O1' }))).toEqual(['W1', 'W2', 'W3', 'O2']);
});

test('a door stays where it is while either end of its wall moves, and refuses a wall that is too short', () => {
  for (const [a, b] of [
    [
      [1, 0.1],
      [5, 0.1],
    ],
    [
      [0, 0.1],
      [4, 0.1],
    ],
  ] as const) {
    const door = straightOfOpening(corners(reshapeWall(HOUSE, 0, 'W1', { a, b, thicknessM: 0.2 }), 'O1'));
    expect([door.a[0], door.b[0]]).toEqual([2, 3]);
  }
  expect(reshapeWall(HOUSE, 0, 'W1', { a: [0, 0.1], b: [0.9, 0.1], thicknessM: 0.2 })).toBeNull();
  const thick = reshapeWall(HOUSE, 0, 'W1', { a: [0, 0.1], b: [5, 0.1], thicknessM: 0.4 });
  expect(straightOfOpening(corners(thick, 'O1')).thicknessM).toBeCloseTo(0.4);
});

test('a door is put into the wall under it, within its ends', () => {
  const made = addOpening(HOUSE, 0, 'door', [5.1, 0.1], 0.9, 0.2);
  expect(made?.id).toBe('O3');
  // At the corner of two walls it goes into one of them, as a whole.
  const door = straightOfOpening(corners(made?.drawn ?? null, 'O3'));
  expect(distance(door.a, door.b)).toBeCloseTo(0.9);
  expect(addOpening(HOUSE, 0, 'window', [2, 3], 1, 0.2)).toBeNull();
  expect(addOpening(HOUSE, 0, 'window', [5.1, 1], 2.5, 0.2)).toBeNull();
  expect(corners(placeOpening(HOUSE, 0, 'O1', [9, 0.1]), 'O1')).toEqual([]);
  expect(corners(placeOpening(HOUSE, 0, 'O1', [4.9, 0.1]), 'O1')).toEqual(box(4, 0, 5, 0.2));
  expect(straightOfOpening(corners(placeOpening(HOUSE, 0, 'O1', [5.1, 4]), 'O1')).a[0]).toBeCloseTo(5.1);
  expect(corners(placeOpening(HOUSE, 0, 'O1', [2.5, 0.1], 2), 'O1')).toEqual(box(1.5, 0, 3.5, 0.2));
});

test('a gap is marked as open, closed by a wall, or gets a door with a wall around it', () => {
  const open = turnOpening(HOUSE, 0, 'O2', 'passage').storeys[0].openings[1];
  expect([open.kind, open.doubtful]).toEqual(['passage', false]);
  const closed = closeOpening(HOUSE, 0, 'O2');
  expect(ids(closed)).toEqual(['W1', 'W2', 'W3', 'W4', 'O1']);
  expect(straightOf(outline(closed, 'W4'))?.thicknessM).toBeCloseTo(0.2);
  const door = turnOpening(HOUSE, 0, 'O2', 'door');
  expect(ids(door)).toEqual(['W1', 'W2', 'W3', 'W4', 'O1', 'O2']);
  expect(ids(closeOpening(HOUSE, 0, 'O1'))).toEqual(['W1', 'W2', 'W3', 'O2']);
});

test('a new wall has an id of its own, and none is made without length', () => {
  const made = addWall(HOUSE, 0, { a: [1, 1], b: [1, 4], thicknessM: 0.1 });
  expect(made?.id).toBe('W4');
  expect(straightOf(outline(made?.drawn ?? null, 'W4'))).toEqual({
    a: [1, 1],
    b: [1, 4],
    thicknessM: expect.closeTo(0.1),
  });
  expect(addWall(HOUSE, 0, { a: [1, 1], b: [1, 1.01], thicknessM: 0.1 })).toBeNull();
});

test('two points and their distance scale everything; a factor of a slip is refused', () => {
  const doubled = rescaled(HOUSE, [[0, 0], [3, 4]], 10); // biome-ignore format: a pair
  expect(doubled?.scale).toBe(2);
  expect(outline(doubled, 'W1')).toEqual(box(0, 0, 10, 0.4));
  expect(corners(doubled, 'O1')).toEqual(box(4, 0, 6, 0.4));
  expect(doubled?.storeys[0].texts[0].at).toEqual([4, 4]);
  expect(doubled?.storeys[0].room_height_m).toBe(2.8);
  expect(rescaled(HOUSE, [[0, 0], [0, 0]], 10)).toBeNull(); // biome-ignore format: a pair
  expect(rescaled(HOUSE, [[0, 0], [1, 0]], 5000)).toBeNull(); // biome-ignore format: a pair
});

test('north is clockwise from up', () => {
  expect(withNorth(HOUSE, [1, 1], [2, 1])?.north_deg).toBe(90);
  expect(withNorth(HOUSE, [1, 1], [0, 2])?.north_deg).toBe(-45);
  expect(withNorth(HOUSE, [1, 1], [1, 1])).toBeNull();
});

test('a room is named by one text inside of it, and loses its name without words', () => {
  const ell: Corners = [
    [0, 1],
    [6, 1],
    [6, 2],
    [3, 2],
    [3, 8],
    [0, 8],
  ];
  const named = nameRoom(HOUSE, 0, ell, ' 7 Kitchen ');
  const { texts } = named.storeys[0];
  expect(texts.map(({ text }) => text)).toEqual(['7 Kitchen']);
  expect(texts[0].at).toEqual([1.5, 5]);
  expect(nameRoom(named, 0, box(10, 0, 12, 2), 'Hall').storeys[0].texts.map(({ text }) => text)).toEqual([
    '7 Kitchen',
    'Hall',
  ]);
  expect(nameRoom(named, 0, ell, '').storeys[0].texts).toEqual([]);
});

test('storeys above keep their distance where a floor or a ceiling is raised', () => {
  const levels = (drawn: Drawn) => drawn.storeys.map(({ elevation_m, room_height_m }) => [elevation_m, room_height_m]);
  expect(levels(raiseFloor(HOUSE, 0, 1.25))).toEqual([[1.25, 2.8], [4.25, 2.8]]); // biome-ignore format: rows
  expect(levels(raiseCeiling(HOUSE, 0, 3.3))).toEqual([[0, 3.3], [3.5, 2.8]]); // biome-ignore format: rows
});
