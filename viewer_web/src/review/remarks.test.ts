import { expect, test } from 'vitest';
import type { Comment, Review } from '../api/documents.ts';
import { EMPTY_REVIEW } from '../testing/fake-review-server.ts';
import { changesSinceSignature, countVerdicts, isOverdue, lastChanges, listedComments, peopleOf } from './remarks.ts';

const comment = (id: string, time: string, resolved = false): Comment => ({
  id,
  text: id,
  author: 'Ada',
  time,
  target: null,
  position_m: null,
  resolved,
  assignee: '',
  due: '',
  photo: '',
});
const touch = (revision: number, by = 'Ada') => ({ revision, by, at: '2026-11-21T16:30:00Z' });

test('open comments come first, newest first', () => {
  const comments = {
    C001: comment('C001', '2026-11-21T10:00:00Z', true),
    C002: comment('C002', '2026-11-20T10:00:00Z'),
    C003: comment('C003', '2026-11-21T09:00:00Z'),
  };
  expect(listedComments({ ...EMPTY_REVIEW, comments }).map(({ id }) => id)).toEqual(['C003', 'C002', 'C001']);
});

test('who changed what last is told newest first', () => {
  const touched = { 'zone:Z001': touch(2), 'station:S001': touch(5, 'Grace'), 'comment:C001': touch(3) };
  const changes = lastChanges({ ...EMPTY_REVIEW, touched }, 2);
  expect(changes.map(({ object, by }) => [object, by])).toEqual([
    ['station:S001', 'Grace'],
    ['comment:C001', 'Ada'],
  ]);
});

test('a signature says what was changed since', () => {
  const signed: Review = {
    ...EMPTY_REVIEW,
    revision: 6,
    sign_off: { name: 'Ada', time: '2026-11-21T16:30:00Z', plan_sha256: '0', revision: 4, note: '' },
    touched: {
      'zone:Z001': touch(2),
      sign_off: touch(4),
      'station:S001': touch(5),
      'comment:C001': touch(6),
      'progress:S001': touch(7),
    },
  };
  expect(changesSinceSignature(signed)).toBe(2);
  expect(changesSinceSignature({ ...signed, touched: { sign_off: touch(4), 'zone:Z001': touch(4) } })).toBe(0);
  expect(changesSinceSignature(EMPTY_REVIEW)).toBe(0);
});

test('stations are counted by their verdicts', () => {
  const verdict = (word: 'accepted' | 'rejected') => ({ verdict: word, by: 'Ada', time: '', note: '' });
  const verdicts = { S001: verdict('accepted'), S003: verdict('rejected'), S009: verdict('accepted') };
  expect(countVerdicts({ ...EMPTY_REVIEW, verdicts }, ['S001', 'S002', 'S003'])).toEqual({
    accepted: 1,
    rejected: 1,
    open: 1,
  });
});

test('a comment is overdue after the day by which it was due, unless it is resolved', () => {
  const late = new Date('2026-12-02T00:00:01');
  expect(isOverdue({ due: '2026-12-01', resolved: false }, late)).toBe(true);
  expect(isOverdue({ due: '2026-12-01', resolved: false }, new Date('2026-12-01T23:00:00'))).toBe(false);
  expect(isOverdue({ due: '2026-12-01', resolved: true }, late)).toBe(false);
  expect(isOverdue({ due: '', resolved: false }, late)).toBe(false);
});

test('whom a review names is listed once', () => {
  const comments = { C001: { ...comment('C001', '2026-11-21T10:00:00Z'), assignee: 'Kim' } };
  expect(peopleOf({ ...EMPTY_REVIEW, comments, touched: { 'zone:Z001': touch(1, 'Kim') } })).toEqual(['Ada', 'Kim']);
});
