import { expect, test } from 'vitest';
import { LEFT_BY_EDITS, NOT_ACHIEVABLE, NOT_ASKED } from '../heat/layers.ts';
import { namesWithRoom } from './names-with-room.ts';
import { type PatchFigures, type PlanRoom, roomClasses, roomFigures, roomLayer, worstFirst } from './rooms.ts';

const NONE = 65535;
const REASONS = ['covered', 'not worth a station', 'occluded', 'inside solids'];

const room = (name: string): PlanRoom => ({
  name,
  source_id: '',
  floor: 'F0',
  label: [0, 0, 0],
  box: [
    [0, 0, 0],
    [1, 1, 1],
  ],
});

/** One patch a row: room, times seen, area, reason. */
function patchesOf(rows: readonly (readonly [number, number, number, number])[], seenFrom = 1): PatchFigures {
  return {
    roomOfPatch: Uint16Array.from(rows, ([one]) => one),
    timesSeen: Uint8Array.from(rows, ([, times]) => times),
    areasM2: Float32Array.from(rows, ([, , areaM2]) => areaM2),
    reasonOfPatch: Uint8Array.from(rows, ([, , , reason]) => reason),
    reasons: REASONS,
    seenFrom,
  };
}

test('a room is covered by what its stations see of its scannable area, and names what most of the rest lacks', () => {
  const patches = patchesOf([
    [0, 2, 3, 0],
    [0, 0, 1, 1],
    [0, NOT_ACHIEVABLE, 0.5, 2],
    // What lies in walls, and what need not be covered, is nobody's worry.
    [0, NOT_ACHIEVABLE, 50, 3],
    [0, NOT_ASKED, 50, 1],
    [1, NOT_ACHIEVABLE, 2, 2],
    [NONE, 0, 9, 1],
  ]);
  const figures = roomFigures([room('Hall'), room('')], patches);
  expect(figures[0]).toMatchObject({ name: 'Hall', scannableM2: 4, seenM2: 3, coverage: 0.75 });
  expect(figures[0].unseen).toEqual({ reason: 'not worth a station', areaM2: 1 });
  expect(figures[0].hidden).toEqual({ reason: 'occluded', areaM2: 0.5 });
  expect(figures[1]).toMatchObject({ name: 'Region 2', scannableM2: 0, coverage: null });
  expect(worstFirst(figures).map(({ name }) => name)).toEqual(['Region 2', 'Hall']);
});

test('what edits leave unseen has no reason of the plan, and one station is too few where two are required', () => {
  const rows = [
    [0, 0, 2, 0],
    [0, 1, 1, 0],
    [0, 2, 1, 0],
  ] as const;
  expect(roomFigures([room('Hall')], patchesOf(rows))[0]).toMatchObject({
    coverage: 0.5,
    unseen: { reason: LEFT_BY_EDITS, areaM2: 2 },
  });
  expect(roomFigures([room('Hall')], patchesOf(rows, 2))[0].coverage).toBe(0.25);
});

test('rooms are coloured by how far they are below what is required', () => {
  const ofCoverage = (seenM2: number): number => {
    const figures = roomFigures(
      [room('Hall')],
      patchesOf([
        [0, 1, seenM2, 0],
        [0, 0, 100 - seenM2, 1],
      ] as const),
    );
    return roomClasses(figures, Uint16Array.of(0), 0.95)[0];
  };
  expect([95, 94, 90, 89, 80, 79].map(ofCoverage)).toEqual([0, 1, 1, 2, 2, 3]);
  const hidden = roomFigures([room('Shaft')], patchesOf([[0, NOT_ACHIEVABLE, 1, 2]]));
  const labels = new Map(roomLayer(0.95).classes.map(({ value, label }) => [value, label]));
  const wordsOf = (number: number) => labels.get(roomClasses(hidden, Uint16Array.of(number), 0.95)[0]);
  expect([wordsOf(0), wordsOf(NONE)]).toEqual(['not scannable', 'in no room']);
  expect(labels.get(1)).toBe('90 % and more');
});

test('names that would cover each other give way to the larger room', () => {
  const name = (number: number, x: number, rank: number) => ({ number, x, y: 0, width: 50, height: 18, rank });
  const kept = namesWithRoom([name(0, 0, 5), name(1, 30, 9), name(2, 90, 1)]);
  expect(kept.map(({ number }) => number)).toEqual([1, 2]);
});
