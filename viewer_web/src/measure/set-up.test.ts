import { Ray, Vector3 } from 'three';
import { expect, test } from 'vitest';
import { type Surroundings, wallsAround } from './set-up.ts';

/** A wall along a line in plan, from one end to the other. */
interface Wall {
  readonly name: string;
  readonly ends: readonly [readonly [number, number], readonly [number, number]];
  readonly isWall?: boolean;
}

/** Rays against lines in plan, by Cramer's rule: no picker, no triangles. */
const around = (walls: readonly Wall[]): Surroundings => ({
  firstHit: ({ origin, direction }: Ray, farM) => {
    let best = null;
    let bestM = farM;
    for (const { name, ends, isWall = true } of walls) {
      const [[ax, ay], [bx, by]] = ends;
      const [ux, uy] = [bx - ax, by - ay];
      const det = direction.x * -uy + direction.y * ux;
      if (Math.abs(det) < 1e-12) continue;
      const [px, py] = [ax - origin.x, ay - origin.y];
      const farOn = (px * -uy + py * ux) / det;
      const share = (direction.x * py - direction.y * px) / det;
      if (farOn <= 0 || farOn >= bestM || share < 0 || share > 1) continue;
      bestM = farOn;
      const normal = new Vector3(uy, -ux, 0).normalize();
      best = { pointM: new Ray(origin, direction).at(farOn, new Vector3()), normal, name, isWall };
    }
    return best;
  },
});

/** A room of 5 x 4 m, turned by 20 degrees. */
const TURN = (20 * Math.PI) / 180;
const turned = (x: number, y: number): [number, number] => [
  x * Math.cos(TURN) - y * Math.sin(TURN),
  x * Math.sin(TURN) + y * Math.cos(TURN),
];
const ROOM: Wall[] = [
  { name: 'south', ends: [turned(0, 0), turned(5, 0)] },
  { name: 'east', ends: [turned(5, 0), turned(5, 4)] },
  { name: 'north', ends: [turned(5, 4), turned(0, 4)] },
  { name: 'west', ends: [turned(0, 4), turned(0, 0)] },
];

test('in a room that is turned, distances are square to its walls, at the height of the instrument', () => {
  const [x, y] = turned(1.2, 1.5);
  const walls = wallsAround([x, y, 1.7], around(ROOM));
  const byName = Object.fromEntries(walls.map(({ name, distanceM }) => [name, distanceM]));
  expect(Object.keys(byName).length).toBe(4);
  for (const [name, farM] of [
    ['west', 1.2],
    ['south', 1.5],
    ['north', 2.5],
    ['east', 3.8],
  ] as const) {
    expect(byName[name]).toBeCloseTo(farM, 6);
  }
  expect(walls.map(({ name }) => name).slice(0, 2)).toEqual(['west', 'south']);
  for (const { footM } of walls) expect(footM[2]).toBeCloseTo(1.7);
  const [fx, fy] = turned(0, 1.5);
  expect(walls[0].footM).toEqual([expect.closeTo(fx), expect.closeTo(fy), expect.closeTo(1.7)]);
});

test('what is no wall is not measured to, and hides the wall behind it', () => {
  const cupboard: Wall = { name: 'cupboard', ends: [turned(0.4, 1), turned(0.4, 2)], isWall: false };
  const [x, y] = turned(1.2, 1.5);
  const names = wallsAround([x, y, 1.7], around([...ROOM, cupboard])).map(({ name }) => name);
  expect(names).toEqual(['south', 'east', 'north']);
});

test('of two parallel walls near by and one across far off, the one across comes second: it fixes the place', () => {
  const corridor: Wall[] = [
    {
      name: 'left',
      ends: [
        [-10, 1],
        [20, 1],
      ],
    },
    {
      name: 'right',
      ends: [
        [-10, -1.2],
        [20, -1.2],
      ],
    },
    {
      name: 'end',
      ends: [
        [15, -1.2],
        [15, 1],
      ],
    },
  ];
  const walls = wallsAround([0, 0, 1.5], around(corridor));
  expect(walls.map(({ name, distanceM }) => [name, Number(distanceM.toFixed(4))])).toEqual([
    ['left', 1],
    ['end', 15],
    ['right', 1.2],
  ]);
});

test('a wall whose perpendicular misses it is not told, and beyond the reach of a laser nothing is', () => {
  // Off to the side: seen, but never squarely.
  expect(
    wallsAround(
      [0, 0, 1],
      around([
        {
          name: 'aside',
          ends: [
            [3, 2],
            [3, 6],
          ],
        },
      ]),
    ),
  ).toEqual([]);
  expect(
    wallsAround(
      [0, 0, 1],
      around([
        {
          name: 'far',
          ends: [
            [31, -9],
            [31, 9],
          ],
        },
      ]),
    ),
  ).toEqual([]);
});
