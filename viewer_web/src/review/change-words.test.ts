import { expect, test } from 'vitest';
import type { Review, StationEdit } from '../api/documents.ts';
import { EMPTY_REVIEW } from '../testing/fake-review-server.ts';
import { changeInWords } from './change-words.ts';

const NO_EDIT: StationEdit = {
  position_m: null,
  instrument_height_m: null,
  floor: null,
  added: false,
  removed: false,
  locked: null,
};
const edited = (edit: Partial<StationEdit>): Review => ({
  ...EMPTY_REVIEW,
  stations: { S001: { ...NO_EDIT, ...edit } },
});

test.each<[Partial<StationEdit>, string]>([
  [{ position_m: [1, 2, 3] }, 'Station S001 moved'],
  [{ position_m: [1, 2, 3], locked: true }, 'Station S001 moved and locked'],
  [{ position_m: [1, 2, 3], added: true }, 'Station S001 added'],
  [{ removed: true }, 'Station S001 removed'],
  [{ locked: true }, 'Station S001 locked'],
  [{ locked: false }, 'Station S001 unlocked'],
])('what became of a station is told: %o', (edit, words) => {
  expect(changeInWords('station:S001', edited(edit))).toBe(words);
});

test('what is left of nothing was taken away', () => {
  const words = [
    'station:S001',
    'verdict:S001',
    'progress:S001',
    'comment:C001',
    'zone:Z001',
    'forbidden:P001',
    'pick:G001',
    'entrance:E001',
    'door:0w$5B',
    'sign_off',
  ].map((object) => changeInWords(object, EMPTY_REVIEW));
  expect(words).toEqual([
    'Station S001 back as planned',
    'Station S001 no longer has a verdict',
    'Station S001 neither done nor skipped',
    'Comment removed',
    'Zone removed',
    'Position allowed again',
    'Floor mark removed',
    'Entrance removed',
    'Door as planned again',
    'Sign-off withdrawn',
  ]);
});

test('verdicts, comments, zones and the signature are told by what they say', () => {
  const time = '2026-11-21T16:30:00Z';
  const review: Review = {
    ...EMPTY_REVIEW,
    verdicts: { S002: { verdict: 'rejected', by: 'Ada', time, note: '' } },
    comments: {
      C001: {
        id: 'C001',
        text: 'The door here stays shut until Friday, says the caretaker.\nHe has the key.',
        author: 'Ada',
        time,
        target: 'S002',
        position_m: null,
        resolved: true,
        assignee: '',
        due: '',
        photo: '',
      },
    },
    zones: {
      Z001: { id: 'Z001', kind: 'keep_out', outline_m: [], floor: 'F0', name: 'Lab', coverage: null },
    },
    sign_off: { name: 'Ada', time, plan_sha256: '0', revision: 4, note: '' },
  };
  expect(changeInWords('verdict:S002', review)).toBe('Station S002 rejected');
  const progress = { S002: { state: 'skipped', by: 'Ada', time } } as const;
  expect(changeInWords('progress:S002', { ...review, progress })).toBe('Station S002 skipped');
  expect(changeInWords('comment:C001', review)).toBe('Comment resolved: “The door here stays shut until Friday, s…”');
  expect(changeInWords('zone:Z001', review)).toBe('Keep-out zone “Lab” drawn');
  expect(changeInWords('sign_off', review)).toBe('Signed off');
  const entrances = { E001: { id: 'E001', position_m: [0, 0, 0] as const, floor: 'F0' } };
  const entered: Review = { ...EMPTY_REVIEW, entrances, doors: { '0w$5B': 'shut' } };
  expect(changeInWords('entrance:E001', entered)).toBe('Entrance set');
  expect(changeInWords('door:0w$5B', entered)).toBe('Door marked as shut');
});
