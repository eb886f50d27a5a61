import { expect, test } from 'vitest';
import { formatUrlState, parseUrlState } from './url-state.ts';

test.each([
  { floorId: null, stationId: null },
  { floorId: 'F1', stationId: null },
  { floorId: null, stationId: 'S012' },
  { floorId: 'Étage & 1 = #2', stationId: 'S 1+1' },
])('a view written to the address is read back: %o', (state) => {
  expect(parseUrlState(formatUrlState(state))).toEqual(state);
});

test('an address that says nothing or nonsense is the default view', () => {
  for (const hash of ['', '#', '#floor=', '#%%%', '#a=b']) {
    expect(parseUrlState(hash), hash).toEqual({ floorId: null, stationId: null });
  }
});
