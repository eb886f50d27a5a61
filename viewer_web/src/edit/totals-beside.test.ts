import { beforeEach, expect, test } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { Change, DraftFigures } from '../api/documents.ts';
import { ReviewClient } from '../api/review-client.ts';
import { metInWords, missedInWords } from '../panels/requirements.tsx';
import { createStore, type Store } from '../store.ts';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { resultOf, smallPlan } from '../testing/small-plan.ts';
import { type Met, planTotals, type Totals } from './totals.ts';
import { totalsBeside } from './totals-beside.ts';

const MOVE: Change = { kind: 'move_station', station: 'S001', position_m: [1005, 2000, 1.3] };

/** Figures of a draft with one station less on the ground floor, as of a revision. */
function figuresAt(revision: number): DraftFigures {
  const { stations, coverage, registration } = smallPlan();
  return {
    revision,
    coverage: { ...coverage, fraction_of_achievable: 0.9 },
    floors: coverage.floors,
    requirements: [resultOf({ name: 'overall', required: 0.95, fraction_of_achievable: 0.9, met: false })],
    stations: stations.slice(1),
    registration,
    curve: [],
    curve_stations: [],
    unseen: [],
  };
}

let reviewClient: ReviewClient;
let store: Store;
beforeEach(async () => {
  reviewClient = new ReviewClient(new ApiClient(new FakeReviewServer().fetch), { listen: () => () => undefined });
  await reviewClient.open();
  store = createStore({ reviewClient });
});

test('without edits there is only the plan, and before it is loaded not even that', () => {
  expect(totalsBeside(store)).toBeNull();
  store.loaded.value = { plan: smallPlan() } as never;
  reviewClient.live.value = { state: 'ready', step: null, fraction: null, message: null };
  reviewClient.figures.value = figuresAt(0);
  expect(totalsBeside(store)).toMatchObject({ planned: { nStations: 3 }, isEdited: false, edited: null });
});

test('the edited plan stands beside the plan, where the live side knows what it is worth', async () => {
  store.loaded.value = { plan: smallPlan() } as never;
  await reviewClient.commit('move', [MOVE]);
  expect(totalsBeside(store)).toMatchObject({ isEdited: true, edited: null });
  reviewClient.live.value = { state: 'ready', step: null, fraction: null, message: null };
  reviewClient.figures.value = figuresAt(reviewClient.review.value!.revision);
  expect(totalsBeside(store)).toMatchObject({
    planned: { nStations: 3, coverage: 0.95 },
    edited: { nStations: 2, coverage: 0.9, floors: [{ nStations: 1 }, { nStations: 1 }] },
    isStale: false,
  });
  reviewClient.figures.value = figuresAt(reviewClient.review.value!.revision - 1);
  expect(totalsBeside(store)?.isStale).toBe(true);
});

test('the plan of a run stands alone, whatever was edited in the plan the page is for', async () => {
  store.loaded.value = { plan: smallPlan() } as never;
  await reviewClient.commit('move', [MOVE]);
  store.planBase.value = 'runs/R001/plan';
  expect(totalsBeside(store)).toMatchObject({ isEdited: false, edited: null });
});

test('what is met and what is not is said in words', () => {
  const floor = { name: 'Ground floor', required: 0.95, coverage: 0.931, isMet: false };
  const all = { name: 'overall', required: 0.9, coverage: 0.97, isMet: true };
  const one = { nNetworks: 1, isNetworkRequired: true, isRedundancyRequired: false, lacksNetwork: false };
  const wordsOf = (requirements: readonly Met[], network: Partial<Totals> = {}): string =>
    metInWords({ ...planTotals(smallPlan()), ...one, requirements, ...network });
  expect(wordsOf([all])).toBe('2 requirements met');
  expect(wordsOf([all], { isNetworkRequired: false })).toBe('1 requirement met');
  expect(wordsOf([floor, all])).toBe('Not met: Ground floor 93.1 % of 95 %');
  expect(wordsOf([all], { nNetworks: 6, lacksNetwork: true })).toBe('Not met: network in 6 groups');
  expect(wordsOf([floor, all], { lacksNetwork: true })).toBe(
    'Not met: Ground floor 93.1 % of 95 %, network held together by single links',
  );
  expect(missedInWords([{ ...all, isMet: false }])).toBe('whole building 97.0 % of 90 %');
});
