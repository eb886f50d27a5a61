import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, test } from 'vitest';
import { runPython } from '../testing/python.ts';
import { faultsOf, formFrom, type RunForm, requestOf } from './run-request.ts';

const ASKED = {
  coverage: 0.95,
  overlap: 0.3,
  seen_from: 2,
  network: 'redundant',
  pre_alignment: 'manual' as const,
  min_probability: 0.995,
  floors: ['F0'],
  asked: { spacing_m: 0.0065, range_m: 20, incidence_rad: (65 * Math.PI) / 180, noise_m: null },
};
const form = (changes: Partial<RunForm> = {}): RunForm => ({ ...formFrom(ASKED), ...changes });

test('the form begins with what the plan was asked', () => {
  expect(requestOf(form({ title: ' Loops ' }))).toEqual({
    title: 'Loops',
    requirements: {
      coverage: '95 %',
      overlap: '30 %',
      network: 'redundant',
      pre_alignment: 'manual',
      link_probability: '99.5 %',
      spacing: '6.5 mm',
      range: '20 m',
      incidence: '65 deg',
      seen_from: 2,
      planned_floors: ['F0'],
    },
    objective: 'fewest',
    max_stations: null,
    from_review: true,
    from_drawing: false,
    time_limit_s: null,
  });
});

test('a request is understood by the reader of requirements, and means what the plan was asked', () => {
  const folder = mkdtempSync(join(tmpdir(), 'request-'));
  const path = join(folder, 'asked.json');
  writeFileSync(path, JSON.stringify(requestOf(form()).requirements));
  const program = [
    'import json, sys, dataclasses',
    'from planner_core.requirements.read import read_requirements',
    'print(json.dumps(dataclasses.asdict(read_requirements(sys.argv[1])[0])))',
  ].join('\n');
  const read = JSON.parse(runPython('-c', program, path));
  rmSync(folder, { recursive: true });
  expect(read).toMatchObject({ coverage: 0.95, overlap: 0.3, seen_from: 2, network: 'redundant', floors: ['F0'] });
  expect(read.pre_alignment).toBe('manual');
  expect(read.min_probability).toBeCloseTo(0.995, 9);
  expect(requestOf(form({ preAlignment: '' })).requirements).not.toHaveProperty('pre_alignment');
  expect(read.limits.spacing_m).toBeCloseTo(0.0065, 9);
  expect(read.limits.range_m).toBe(20);
  expect(read.limits.incidence_rad).toBeCloseTo((65 * Math.PI) / 180, 9);
  expect(read.limits.noise_m).toBeNull();
});

test.each([
  [{ coveragePercent: '120' }, 'coveragePercent', /1 to 100 %/],
  [{ coveragePercent: 'most' }, 'coveragePercent', /a number/],
  [{ linkProbabilityPercent: '100' }, 'linkProbabilityPercent', /0 to below 100 %/],
  [{ linkProbabilityPercent: '-1' }, 'linkProbabilityPercent', /0 to below 100 %/],
  [{ seenFrom: '1.5' }, 'seenFrom', /whole number/],
  [{ objective: 'coverage', maxStations: '' }, 'maxStations', /enter the number of stations/],
] as [Partial<RunForm>, keyof RunForm, RegExp][])('%j is told to be wrong', (changes, field, words) => {
  expect(faultsOf(form(changes))[field as 'seenFrom']).toMatch(words);
  expect(Object.keys(faultsOf(form(changes)))).toEqual([field]);
});

test('networks of earlier plans are asked for by the words of today', () => {
  const asked = (network?: string) => formFrom({ coverage: 0.95, overlap: 0.3, network }).network;
  expect(['joined', 'loops', 'none', 'redundant'].map(asked)).toEqual(['connected', 'redundant', 'none', 'redundant']);
  expect(asked()).toBe('connected');
});

test('a decimal comma is a decimal point, and what is left empty is not asked', () => {
  const { requirements } = requestOf(form({ spacingMm: '6,25', rangeM: ' ', incidenceDeg: '' }));
  expect(requirements).toMatchObject({ spacing: '6.25 mm' });
  expect(Object.keys(requirements)).not.toContain('range');
  expect(faultsOf(form())).toEqual({});
});
