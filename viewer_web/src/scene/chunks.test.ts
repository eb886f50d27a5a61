import { expect, test } from 'vitest';
import { WHOLE_BUILDING } from '../floors/cut.ts';
import type { StageElement } from '../load/stage.ts';
import { lineChunks, reaches, surfaceChunks } from './chunks.ts';

/** Elements of so many triangles each, one above the other. */
function storeys(sizes: readonly number[]): { cornersM: Float32Array; elements: StageElement[] } {
  const total = sizes.reduce((sum, n) => sum + n, 0);
  const cornersM = new Float32Array(9 * total);
  let first = 0;
  const elements = sizes.map((nTriangles, storey) => {
    for (let i = 9 * first + 2; i < 9 * (first + nTriangles); i += 3) cornersM[i] = 3 * storey + (i % 2);
    const element = {
      sceneIndex: storey,
      name: '',
      kind: '',
      sourceId: '',
      floorId: '',
      file: 0,
      firstTriangle: first,
      nTriangles,
    };
    first += nTriangles;
    return element;
  });
  return { cornersM, elements };
}

test('pieces hold every triangle once, in order, and know their heights', () => {
  const { cornersM, elements } = storeys([40_000, 10, 90_000, 5, 33_000, 1]);
  const chunks = surfaceChunks(cornersM, elements);
  expect(chunks.length).toBeGreaterThan(2);
  let next = 0;
  for (const { geometry, firstTriangle, lowestM, highestM } of chunks) {
    expect(firstTriangle).toBe(next);
    const own = geometry.getAttribute('position').array as Float32Array;
    expect(own.buffer).toBe(cornersM.buffer);
    next += own.length / 9;
    const heights = own.filter((_, i) => i % 3 === 2);
    expect([lowestM, highestM]).toEqual([
      heights.reduce((a, b) => Math.min(a, b)),
      heights.reduce((a, b) => Math.max(a, b)),
    ]);
  }
  expect(next).toBe(163_016);
});

test('a storey begins a piece of its own, unless too little is left of the one before', () => {
  const { cornersM, elements } = storeys([3000, 20, 5000, 4000]);
  const onFloors = ['F0', 'F0', 'F1', 'F2'].map((floorId, i) => ({ ...elements[i], floorId }));
  const firsts = (of: readonly StageElement[]) => surfaceChunks(cornersM, of).map(({ firstTriangle }) => firstTriangle);
  expect(firsts(onFloors)).toEqual([0, 3020, 8020]);
  // One storey of all: one piece, which every slice of it draws.
  expect(firsts(elements)).toEqual([0]);
  const [first, second, ...others] = onFloors;
  expect(firsts([first, { ...second, floorId: '' }, ...others])).toEqual([0, 3000, 8020]);
});

test('a slice draws the pieces it reaches', () => {
  const { cornersM, elements } = storeys([40_000, 40_000, 40_000]);
  const chunks = surfaceChunks(cornersM, elements);
  const slice = { ...WHOLE_BUILDING, bottomM: 2.9, topM: 4.5 };
  expect(chunks.map((chunk) => reaches(chunk, slice))).toEqual([false, true, false]);
  expect(chunks.every((chunk) => reaches(chunk, WHOLE_BUILDING))).toBe(true);
});

test('a file begins a piece of its own, however little is left of the one before', () => {
  const { cornersM, elements } = storeys([3000, 20, 5000, 1]);
  const chunks = surfaceChunks(
    cornersM,
    elements.map((element, i) => ({ ...element, file: [0, 1, 1, 2][i] })),
  );
  expect(chunks.map(({ file, firstTriangle }) => [file, firstTriangle])).toEqual([
    [0, 0],
    [1, 3000],
    [2, 8020],
  ]);
});

test('lines come in pieces of whole lines of one file, and none of no lines', () => {
  const { elements } = storeys([1, 1, 1]);
  const firstLine = Int32Array.of(0, 100_000, 100_010, 150_000);
  const edges = { linesM: new Float32Array(6 * 150_000), firstLine, bodySide: new Int8Array(3) };
  const chunks = lineChunks(
    edges,
    elements.map((element, i) => ({ ...element, file: i === 0 ? 0 : 1 })),
  );
  const linesOf = (file: number) =>
    chunks
      .filter((chunk) => chunk.file === file)
      .reduce((sum, { geometry }) => sum + geometry.getAttribute('position').array.length / 6, 0);
  expect([linesOf(0), linesOf(1)]).toEqual([100_000, 50_000]);
  const lengths = chunks.map(({ geometry }) => geometry.getAttribute('position').array.length);
  expect(lengths.every((n) => n % 6 === 0)).toBe(true);
  expect(lengths.reduce((a, b) => a + b)).toBe(6 * 150_000);
  expect(lineChunks({ ...edges, linesM: new Float32Array(0), firstLine: new Int32Array(4) }, elements)).toEqual([]);
});
