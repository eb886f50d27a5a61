import { expect, test } from 'vitest';
import type { Comment, Review } from '../api/documents.ts';
import { draftStations } from '../edit/draft.ts';
import { planTotals, type Totals } from '../edit/totals.ts';
import type { TotalsBeside } from '../edit/totals-beside.ts';
import { EMPTY_REVIEW } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { concernsOf, keptOutStations } from './concerns.ts';

const FINE: Totals = { ...planTotals(smallPlan()), nNetworks: 1, isNetworkRequired: true, lacksNetwork: false };
const MISSED = { name: 'Ground floor', required: 0.95, coverage: 0.9, isMet: false };
const beside = (changes: Partial<TotalsBeside> = {}): TotalsBeside => ({
  planned: FINE,
  isEdited: false,
  edited: null,
  isStale: false,
  ...changes,
});

function concerns(review: Partial<Review>, totals = beside()): [string, string][] {
  const reviewed = { ...EMPTY_REVIEW, ...review };
  const stations = draftStations(smallPlan(), reviewed);
  return concernsOf({ review: reviewed, stations, totals }).map(({ kind, words }) => [kind, words]);
}

test('nothing speaks against a plan that meets all and that nobody objects to', () => {
  expect(concerns({})).toEqual([]);
});

test('missed requirements and a network in parts are those of the plan as edited, where it is', () => {
  const poor: Totals = { ...FINE, nNetworks: 2, lacksNetwork: true, requirements: [MISSED] };
  const expected = [
    ['requirement', 'Not met: Ground floor 90.0 % of 95 %'],
    ['network', 'Network in 2 unconnected groups, required: connected'],
  ];
  expect(concerns({}, beside({ planned: poor }))).toEqual(expected);
  expect(concerns({}, beside({ isEdited: true, edited: poor }))).toEqual(expected);
  expect(concerns({}, beside({ planned: poor, isEdited: true, edited: FINE }))).toEqual([]);
  expect(concerns({}, beside({ planned: { ...poor, lacksNetwork: false } }))).toEqual(expected.slice(0, 1));
  expect(concerns({}, beside({ planned: { ...FINE, lacksNetwork: true } }))).toEqual([
    ['network', 'Network held together by single links, required: redundant'],
  ]);
});

test('what nobody has computed is not taken for met', () => {
  expect(concerns({}, beside({ isEdited: true })).map(([kind]) => kind)).toEqual(['unknown']);
  expect(concerns({}, beside({ isEdited: true, edited: FINE, isStale: true })).map(([kind]) => kind)).toEqual([
    'unknown',
  ]);
});

test('rejected stations count while they are in the plan, and comments while they are open', () => {
  const verdict = { verdict: 'rejected', by: 'Ada', time: '2026-11-21T16:30:00Z', note: '' } as const;
  const comment = { id: 'c1', text: '', author: '', time: '', target: null, position_m: null } as unknown as Comment;
  const review = {
    verdicts: { S001: verdict, S003: verdict, S002: { ...verdict, verdict: 'accepted' as const } },
    comments: { c1: { ...comment, resolved: false }, c2: { ...comment, resolved: true } },
  };
  expect(concerns(review)).toEqual([
    ['rejected', 'S001, S003 are rejected and still in the plan'],
    ['comment', '1 comment is open'],
  ]);
  const removed = {
    position_m: null,
    instrument_height_m: null,
    floor: null,
    added: false,
    removed: true,
    locked: null,
  };
  const stations = { S001: removed, S003: removed };
  expect(concerns({ ...review, stations }).map(([kind]) => kind)).toEqual(['comment']);
});

test('stations in a keep-out area or a forbidden place of their floor are told', () => {
  const zone = (floor: string, kind: 'keep_out' | 'priority' = 'keep_out') => ({
    id: 'z1',
    kind,
    floor,
    name: '',
    coverage: null,
    // Around S001 alone.
    outline_m: [
      [1000.5, 1999],
      [1001.5, 1999],
      [1001.5, 2001],
      [1000.5, 2001],
    ] as [number, number][],
  });
  const keptOut = (review: Partial<Review>): string[] => {
    const reviewed = { ...EMPTY_REVIEW, ...review };
    return keptOutStations(reviewed, draftStations(smallPlan(), reviewed));
  };
  expect(keptOut({ zones: { z1: zone('F0') } })).toEqual(['S001']);
  expect(keptOut({ zones: { z1: zone('F1') } })).toEqual([]);
  expect(keptOut({ zones: { z1: zone('', 'priority') } })).toEqual([]);
  const place = (floor: string) => ({ id: 'f1', position_m: [1003.2, 2000, 0] as const, radius_m: 0.5, floor });
  expect(keptOut({ forbidden: { f1: place('') } })).toEqual(['S003']);
  expect(keptOut({ forbidden: { f1: place('F0') } })).toEqual([]);
  expect(concerns({ zones: { z1: zone('') }, forbidden: { f1: place('') } })).toEqual([
    ['kept_out', 'S001, S003 are in keep-out zones or at forbidden positions'],
  ]);
});
