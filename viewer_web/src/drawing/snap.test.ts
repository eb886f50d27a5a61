import { expect, test } from 'vitest';
import { SegmentIndex, snapped } from './snap.ts';

const WALL = [[0, 0], [4, 0]] as const; // biome-ignore format: a segment
const LINES = new SegmentIndex([[[2, 1], [2, 30]], [[0.1, 0.05], [0.1, 5]]]); // biome-ignore format: segments
const TO = { axes: [WALL], lines: LINES, from: null, withinM: 0.2 };

test('ends of walls come before corners of the drawing, and corners before lines', () => {
  expect(snapped([0.08, 0.04], TO)).toEqual({ at: [0, 0], kind: 'corner' });
  expect(snapped([2.1, 1.1], TO)).toEqual({ at: [2, 1], kind: 'corner' });
  expect(snapped([1, 0.1], TO)).toEqual({ at: [1, 0], kind: 'line' });
  expect(snapped([2.1, 17.3], TO)).toEqual({ at: [2, 17.3], kind: 'line' });
  expect(snapped([1, 0.3], TO)).toEqual({ at: [1, 0.3], kind: 'free' });
});

test('from a first point right angles are kept, up to the line that they meet', () => {
  expect(snapped([1.05, 3], { ...TO, from: [1, 1.5] })).toEqual({ at: [1, 3], kind: 'angle' });
  const met = snapped([2.1, 6.04], { ...TO, from: [1, 6] });
  expect(met.kind).toBe('line');
  expect(met.at[0]).toBeCloseTo(2);
  expect(met.at[1]).toBeCloseTo(6);
  // Of a wall that runs askew, its own direction counts.
  const askew = snapped([0.8 * 5, 0.6 * 5 + 3.05], { ...TO, from: [0, 3], along: [0.8, 0.6], lines: null });
  expect(askew.at[0] * 0.6).toBeCloseTo((askew.at[1] - 3) * 0.8);
});
