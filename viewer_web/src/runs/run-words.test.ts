import { expect, test } from 'vitest';
import type { Run, RunBest } from '../api/documents.ts';
import { bestInWords, progressInWords, shareDone } from './run-words.ts';

const run = (changes: Partial<Run> = {}): Run => ({
  id: 'R001',
  title: '',
  state: 'running',
  created: '2026-11-21T16:30:00Z',
  stage: 'scan',
  done: 30,
  total: 120,
  note: null,
  best: null,
  message: null,
  plan: null,
  ended: null,
  cancelling: false,
  warnings: [],
  request: { title: '', requirements: {}, objective: 'fewest' },
  resumed_from: null,
  plan_sha256: '0',
  revision: 0,
  ...changes,
});
const best = (changes: Partial<RunBest> = {}): RunBest => ({
  n_stations: 14,
  lower_bound: 12,
  fraction_of_achievable: 0.9517,
  stations: [],
  ...changes,
});

test('progress names the stage and its steps where they are known', () => {
  expect(progressInWords(run())).toBe('scan 30 of 120');
  expect(progressInWords(run({ total: 0 }))).toBe('scan');
  expect(progressInWords(run({ stage: null, done: null, total: null }))).toBe('starting');
  expect(progressInWords(run({ note: 'bound 12' }))).toBe('scan 30 of 120: bound 12');
  expect([run(), run({ total: 0 }), run({ done: 130 })].map(shareDone)).toEqual([0.25, null, 1]);
});

test('the best so far is told with its bound, and as proven where they meet', () => {
  expect(bestInWords(run())).toBe('');
  expect(bestInWords(run({ best: best() }))).toBe('14 stations, lower bound 12, 95.2 % coverage');
  expect(bestInWords(run({ best: best({ lower_bound: 14, fraction_of_achievable: null }) }))).toBe(
    '14 stations, proven minimum',
  );
  expect(bestInWords(run({ best: best({ lower_bound: null }) }))).toBe('14 stations, 95.2 % coverage');
});
