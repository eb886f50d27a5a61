import { expect, test } from 'vitest';
import type { StationEdit } from '../api/documents.ts';
import { EMPTY_REVIEW, stationEdit as edit } from '../testing/fake-review-server.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { countEdits, draftStations, editsInWords, shownInDraft } from './draft.ts';

const reviewWith = (stations: Record<string, StationEdit>) => ({ ...EMPTY_REVIEW, stations });

test('without a review the draft is the plan', () => {
  const plan = smallPlan();
  const stations = draftStations(plan, null);
  expect(stations.map(({ id, positionM }) => [id, positionM])).toEqual(plan.stations.map((s) => [s.id, s.position]));
  expect(editsInWords(countEdits(stations))).toBe('');
});

test('a review moves, adds, removes and locks', () => {
  const stations = draftStations(
    smallPlan(),
    reviewWith({
      S001: edit({ position_m: [1003, 2001, 1.5], instrument_height_m: 1.5, floor: 'F0' }),
      S002: edit({ removed: true }),
      S003: edit({ locked: true }),
      S010: edit({ position_m: [1000, 2000, 1.3], floor: 'F0', instrument_height_m: 1.3, added: true }),
    }),
  );
  // The added one comes behind the nearest of its floor, and no number changes because another station is gone.
  expect(
    stations.map(({ id, order, number, isRemoved, isLocked }) => [id, order, number, isRemoved, isLocked]),
  ).toEqual([
    ['S001', 1, 1, false, false],
    ['S010', 2, 10, false, false],
    ['S002', 0, 0, true, false],
    ['S003', 3, 3, false, true],
  ]);
  expect(stations[0].movedFromM).toEqual([1001, 2000, 1.3]);
  expect(editsInWords(countEdits(stations))).toBe('1 moved, 1 added, 1 removed');
});

test('a station that was moved back is not moved', () => {
  const [first] = draftStations(smallPlan(), reviewWith({ S001: edit({ position_m: [1001, 2000, 1.3] }) }));
  expect(first.movedFromM).toBeNull();
});

test('what is drawn is in the local frame, with its marks and without what was removed', () => {
  const review = reviewWith({
    S001: edit({ position_m: [1003, 2001, 1.5], locked: true }),
    S002: edit({ removed: true }),
  });
  const shown = shownInDraft(draftStations(smallPlan(), review), [1000, 2000, 0]);
  expect(shown.map(({ id }) => id)).toEqual(['S001', 'S003']);
  expect(shown[0]).toMatchObject({ positionM: [3, 1, 1.5], marks: ['moved', 'locked'] });
});
