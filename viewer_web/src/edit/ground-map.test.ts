import { expect, test } from 'vitest';
import { GROUND, GroundMap, type Place } from './ground-map.ts';

/** Pictures with the highest y first: '#' nothing, '.' walkable, 'o' admissible, 'x' kept out. */
function mapOf(picture: string, cellM = 0.5, origin: Place = [1000, -50]): GroundMap {
  const rows = picture.trim().split(/\s+/).reverse();
  const values = Uint8Array.from(rows.join(''), (letter) => '#.ox'.indexOf(letter));
  return new GroundMap({ floor: 'F0', origin, cell_m: cellM, width: rows[0].length, height: rows.length }, values);
}

const ROOM = mapOf(`
  #######
  #.....#
  #.ooo.#
  #.ooo.#
  #.....#
  #######`);

/** Every admissible cell, looked at one by one. */
function nearestByForce(map: GroundMap, [x, y]: Place): number {
  const { origin, cell_m, width } = map.head;
  let best = Number.POSITIVE_INFINITY;
  map.values.forEach((value, i) => {
    if (value !== GROUND.admissible) return;
    const dx = Math.max(0, Math.abs(origin[0] + ((i % width) + 0.5) * cell_m - x) - cell_m / 2);
    const dy = Math.max(0, Math.abs(origin[1] + (Math.floor(i / width) + 0.5) * cell_m - y) - cell_m / 2);
    best = Math.min(best, Math.hypot(dx, dy));
  });
  return best;
}

test('a place where a tripod may stand is kept as it is', () => {
  expect(ROOM.nearestAdmissible([1001.1, -48.9])).toEqual([1001.1, -48.9]);
});

test('a place in a wall slides along it to the nearest ground', () => {
  const [x, y] = ROOM.nearestAdmissible([1003.4, -48.9])!;
  expect(y).toBe(-48.9);
  expect(x).toBeGreaterThan(1002.45);
  expect(x).toBeLessThan(1002.5);
});

test('the nearest place is the nearest of all cells, wherever the pointer is', () => {
  let seed = 7;
  const random = (): number => {
    seed = (seed * 1103515245 + 12345) % 2147483648;
    return seed / 2147483648;
  };
  const picture = Array.from({ length: 23 }, () =>
    Array.from({ length: 31 }, () => (random() < 0.03 ? 'o' : '#')).join(''),
  );
  const map = mapOf(picture.join('\n'), 0.25);
  for (let i = 0; i < 400; i++) {
    const pointer: Place = [998 + 12 * random(), -52 + 10 * random()];
    const place = map.nearestAdmissible(pointer)!;
    expect(map.at(place), `${pointer}`).toBe(GROUND.admissible);
    const distanceM = Math.hypot(place[0] - pointer[0], place[1] - pointer[1]);
    expect(Math.abs(distanceM - nearestByForce(map, pointer)), `${pointer}`).toBeLessThan(0.25 * 0.05);
  }
});

test('cells that a review keeps out are no ground, and outside the map is nothing', () => {
  const map = mapOf('xo.');
  expect(map.at([1000.4, -49.6])).toBe(GROUND.keptOut);
  expect(map.nearestAdmissible([1000.1, -49.6])![0]).toBeGreaterThan(1000.5);
  expect(map.at([1002, -49.6])).toBe(GROUND.nothing);
});

test('a floor without ground for a tripod has no place', () => {
  expect(mapOf('#.x').nearestAdmissible([1000, -50])).toBeNull();
});

test('a map with too few cells is refused', () => {
  const head = { floor: 'F0', origin: [0, 0] as Place, cell_m: 1, width: 3, height: 2 };
  expect(() => new GroundMap(head, new Uint8Array(5))).toThrow(/5 cells, expected 6/);
});
