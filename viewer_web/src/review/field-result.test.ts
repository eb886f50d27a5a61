import { expect, test } from 'vitest';
import { draftStations } from '../edit/draft.ts';
import { smallPlan } from '../testing/small-plan.ts';
import { changesOfField, FIELD_SCHEMA, movesOfField, readFieldResult } from './field-result.ts';

const stations = draftStations(smallPlan(), null);
const [a, b, c] = stations;
const nothing = { state: null, moved_to: null, note: '', photo: false };
const file = (...told: readonly object[]): string =>
  JSON.stringify({
    schema: FIELD_SCHEMA,
    plan_sha256: 'ab',
    revision: 3,
    name: 'Ada',
    saved_at: '2026-11-23T14:05:06Z',
    stations: told,
  });

test('moved stations are moved at their height, what was said is a comment, and the rest is told in one line', () => {
  const [x, y, z] = b.positionM;
  const result = readFieldResult(
    file(
      { ...nothing, id: a.id, state: 'done' },
      { ...nothing, id: b.id, state: 'done', moved_to: [x + 0.3, y - 0.4], photo: true },
      { ...nothing, id: c.id, state: 'skipped', note: ' Door locked ' },
    ),
  );
  expect([result.revision, result.planSha256]).toEqual([3, 'ab']);
  const changes = changesOfField(result, stations);
  expect(changes[0]).toEqual({
    kind: 'move_station',
    station: b.id,
    position_m: [x + 0.3, y - 0.4, z],
    instrument_height_m: b.instrumentHeightM,
    floor: b.floorId,
  });
  expect(changes.slice(1)).toMatchObject([
    { kind: 'set_progress', station: a.id, state: 'done' },
    { kind: 'set_progress', station: b.id, state: 'done' },
    { kind: 'set_progress', station: c.id, state: 'skipped' },
    { kind: 'add_comment', target: b.id, text: 'On site (Ada): set up 0.50 m away; photo taken' },
    { kind: 'add_comment', target: c.id, text: 'On site (Ada): skipped; Door locked' },
    { kind: 'add_comment', target: null },
  ]);
  const { text } = changes.at(-1) as { text: string };
  expect(text).toContain(`Field result of Ada. 2 of ${stations.length} stations done: ${a.id}, ${b.id}`);
  expect(text).toContain(`skipped: ${c.id}`);
});

test('the same file makes comments of the same ids, which a review takes once', () => {
  const ids = (): unknown[] =>
    changesOfField(readFieldResult(file({ ...nothing, id: a.id, note: 'n' })), stations).map(
      (change) => 'id' in change && change.id,
    );
  expect(ids()).toEqual(ids());
  for (const id of ids()) expect(id).toMatch(/^[A-Za-z][A-Za-z0-9_]{0,31}$/);
});

test('what the review has already is not marked again, and what the crew did not come to stays as it is', () => {
  const result = readFieldResult(
    file({ ...nothing, id: a.id, state: 'done' }, { ...nothing, id: b.id, state: 'done' }, { ...nothing, id: c.id }),
  );
  const [by, time] = ['Ben', '2026-11-22T10:00:00Z'];
  const progress = { [a.id]: { state: 'done', by, time }, [c.id]: { state: 'done', by, time } } as const;
  const changes = changesOfField(result, stations, new Set(), progress);
  expect(changes).toMatchObject([{ kind: 'set_progress', station: b.id, state: 'done' }, { kind: 'add_comment' }]);
});

test('a move that is rejected is a comment alone', () => {
  const [x, y] = a.positionM;
  const result = readFieldResult(file({ ...nothing, id: a.id, moved_to: [x + 1, y] }));
  expect(movesOfField(result, stations)).toEqual([{ station: a, to: [x + 1, y], awayM: 1 }]);
  const changes = changesOfField(result, stations, new Set([a.id]));
  expect(changes.map(({ kind }) => kind)).toEqual(['add_comment', 'add_comment']);
  expect(changes[0]).toMatchObject({ text: expect.stringContaining('set up 1.00 m away to x') });
});

test('a station that is locked stays, and where it stood is told', () => {
  const locked = stations.map((station) => ({ ...station, isLocked: true }));
  const changes = changesOfField(readFieldResult(file({ ...nothing, id: a.id, moved_to: [1, 2] })), locked);
  expect(changes.map(({ kind }) => kind)).toEqual(['add_comment', 'add_comment']);
  expect(changes[0]).toMatchObject({ text: expect.stringContaining('to x 1.00, y 2.00, and not moved here') });
});

test.each([
  ['no', /is no JSON/],
  ['{"schema": "other/1"}', /is no tlsplan\/field\/1/],
  [JSON.stringify({ schema: FIELD_SCHEMA, revision: -1 }), /damaged at its head/],
  [file({ ...nothing, id: 'S001', moved_to: [1, 'x'] }), /damaged at station S001/],
  [file({ ...nothing, id: 'S001', state: 'lost' }), /damaged at station S001/],
])('what is no field result is refused in words: %s', (text, words) => {
  expect(() => readFieldResult(text)).toThrow(words);
});

test('a station that the review does not have is named', () => {
  const result = readFieldResult(file({ ...nothing, id: 'S999', note: 'n' }));
  expect(() => changesOfField(result, stations)).toThrow('names S999');
});
