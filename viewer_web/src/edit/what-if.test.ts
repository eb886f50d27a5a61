import { expect, test } from 'vitest';
import { OUT_OF_SCOPE } from '../heat/layers.ts';
import { linkChange, surfaceChange } from './what-if.ts';

const COUNTING = { threshold: 0.3, minStrength: 0, minProbability: 0 };
const link = (a: string, b: string, overlap: number) => ({ a, b, overlap, strength: null, as_set_up: false });

test('won is what is covered then and was not, lost the other way round, of what has to be covered', () => {
  const before = {
    timesSeen: Uint8Array.of(0, 1, 2, 0, 255, 1, 1),
    areasM2: Float32Array.of(1, 2, 4, 8, 16, 32, 64),
    scope: Uint8Array.of(0, 0, 0, OUT_OF_SCOPE, 0, 0, 0),
    seenFrom: 1,
  };
  const delta = { patches: Uint32Array.of(0, 1, 2, 3, 4, 5), timesSeen: Uint8Array.of(1, 0, 1, 1, 1, 2) };
  expect(surfaceChange(delta, before)).toEqual({ won: [0], lost: [1], wonM2: 1, lostM2: 2 });
  // Where two stations are required, one more or less decides elsewhere.
  expect(surfaceChange(delta, { ...before, seenFrom: 2 })).toEqual({ won: [5], lost: [2], wonM2: 32, lostM2: 4 });
});

test('links are won and lost by whether they count, of a new station all are won', () => {
  const before = [link('A', 'B', 0.4), link('C', 'A', 0.5), link('B', 'C', 0.9)];
  const after = [link('A', 'B', 0.29), link('A', 'C', 0.5), link('A', 'D', 0.3)];
  expect(linkChange('A', before, after, COUNTING)).toEqual({ kept: ['C'], won: ['D'], lost: ['B'] });
  expect(linkChange(null, before, [link('', 'B', 0.5)], COUNTING)).toEqual({ kept: [], won: ['B'], lost: [] });
});
