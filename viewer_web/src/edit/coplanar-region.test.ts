import { expect, test } from 'vitest';
import { coplanarRegion, isSteep } from './coplanar-region.ts';

/** A rectangle as two triangles, from its lowest corner. */
function rectangle(x: number, y: number, z: number, width: number, depth: number, tiltRad = 0): number[] {
  const rise = Math.tan(tiltRad) * width;
  const a = [x, y, z];
  const b = [x + width, y, z + rise];
  const c = [x + width, y + depth, z + rise];
  const d = [x, y + depth, z];
  return [...a, ...b, ...c, ...a, ...c, ...d];
}
const mesh = (...rectangles: number[][]): Float32Array => Float32Array.from(rectangles.flat());
const regionOf = (cornersM: Float32Array, clicked: number): number[] =>
  coplanarRegion(cornersM, clicked).sort((a, b) => a - b);

test('the region is what lies in one plane and hangs together', () => {
  const cornersM = mesh(
    rectangle(0, 0, 0, 2, 2),
    rectangle(2, 0, 0, 2, 2), // beside it
    rectangle(6, 0, 0, 2, 2), // in the plane, apart
    rectangle(0, 2, 0.2, 2, 2), // a step up
  );
  expect(regionOf(cornersM, 1)).toEqual([0, 1, 2, 3]);
  expect(regionOf(cornersM, 4)).toEqual([4, 5]);
  expect(regionOf(cornersM, 6)).toEqual([6, 7]);
});

test('a ramp that begins at an edge of the floor is not the floor', () => {
  const ramp = rectangle(2, 0, 0, 2, 2, 0.1);
  expect(regionOf(mesh(rectangle(0, 0, 0, 2, 2), ramp), 0)).toEqual([0, 1]);
});

test('faces turned the other way round belong to the region', () => {
  const turned = rectangle(2, 0, 0, 2, 2);
  const flipped = [0, 2, 1, 3, 5, 4].flatMap((corner) => turned.slice(3 * corner, 3 * corner + 3));
  expect(regionOf(mesh(rectangle(0, 0, 0, 2, 2), flipped), 0)).toEqual([0, 1, 2, 3]);
});

test('touching at a corner is not joining', () => {
  expect(regionOf(mesh(rectangle(0, 0, 0, 2, 2), rectangle(2, 2, 0, 2, 2)), 0)).toEqual([0, 1]);
});

test('a triangle without area has no region', () => {
  expect(coplanarRegion(new Float32Array(9), 0)).toEqual([]);
});

test('an uneven floor has one region, whichever triangle is clicked', () => {
  // Strips that rise and fall by 4 mm: a plane through one of them alone leaves the floor after two.
  const strip = (i: number): number[] => {
    const [z0, z1] = [0.004 * (i % 2), 0.004 * ((i + 1) % 2)];
    const [a, b, c, d] = [
      [i, 0, z0],
      [i + 1, 0, z1],
      [i + 1, 4, z1],
      [i, 4, z0],
    ];
    return [...a, ...b, ...c, ...a, ...c, ...d];
  };
  const cornersM = mesh(...Array.from({ length: 8 }, (_, i) => strip(i)));
  for (let clicked = 0; clicked < 16; clicked++) expect(coplanarRegion(cornersM, clicked)).toHaveLength(16);
});

test('walls and ramps are too steep to stand on', () => {
  const cornersM = mesh(rectangle(0, 0, 0, 2, 2), rectangle(0, 0, 0, 2, 2, 0.16), rectangle(0, 0, 0, 2, 2, 0.19));
  expect([0, 2, 4].map((triangle) => isSteep(cornersM, triangle))).toEqual([false, false, true]);
  expect(isSteep(Float32Array.of(0, 0, 0, 1, 0, 0, 1, 0, 1), 0)).toBe(true);
  expect(isSteep(new Float32Array(9), 0)).toBe(true);
});
