import { expect, test } from 'vitest';
import {
  freeName,
  hashToKeep,
  LONGEST_NAME,
  MOST_VIEWS,
  readViews,
  renamed,
  type SavedView,
  stateOfView,
  type ViewStorage,
  viewsKey,
  withView,
  writeViews,
} from './saved-views.ts';

function storage(text: string | null = null): ViewStorage & { text: string | null } {
  return {
    text,
    getItem() {
      return this.text;
    },
    setItem(_, value) {
      this.text = value;
    },
  };
}
const refused = (): never => {
  throw new DOMException('denied', 'SecurityError');
};
const HALL: SavedView = { name: 'Hall', hash: '#floor=F0&camera=1,2,3,4,5,6' };

test('what is kept is read back', () => {
  const own = storage();
  expect(readViews(() => own, 'key')).toEqual([]);
  expect(writeViews(() => own, 'key', [HALL])).toBe(true);
  expect(readViews(() => own, 'key')).toEqual([HALL]);
});

test.each(['{', '{}', '"text"', '7'])('%s is not read, and breaks nothing', (text) => {
  expect(readViews(() => storage(text), 'key')).toBeNull();
});

test('of a list only what is a view counts, and no more than are kept', () => {
  const text = JSON.stringify([null, 1, {}, { name: '', hash: '#' }, { name: 'x', hash: '#'.repeat(9999) }, HALL]);
  expect(readViews(() => storage(text), 'key')).toEqual([HALL]);
  const many = storage(JSON.stringify(Array(999).fill(HALL)));
  expect(readViews(() => many, 'key')).toHaveLength(MOST_VIEWS);
});

test('a browser without storage, or one that is full, is reported and breaks nothing', () => {
  expect(readViews(refused, 'key')).toBeNull();
  expect(writeViews(refused, 'key', [HALL])).toBe(false);
  expect(writeViews(() => ({ getItem: () => null, setItem: refused }), 'key', [HALL])).toBe(false);
});

test('views are bounded in number and length, and their names differ', () => {
  expect(withView([HALL], ' Hall ', '#b')).toEqual([HALL, { name: 'Hall (2)', hash: '#b' }]);
  expect(withView([], 'x'.repeat(500), '#')).toEqual([{ name: 'x'.repeat(LONGEST_NAME), hash: '#' }]);
  expect(withView(Array(MOST_VIEWS).fill(HALL), 'more', '#')).toMatch(/delete one first/);
  expect(withView([], 'long', '#'.repeat(3000))).toMatch(/too many files/);
  const long = 'x'.repeat(LONGEST_NAME);
  expect(freeName(long, [{ name: long, hash: '' }])).toHaveLength(LONGEST_NAME - 1);
});

test('a view is renamed in its place, to itself too', () => {
  const stair = { name: 'Stair', hash: '#s' };
  expect(renamed([HALL, stair], 'Hall', 'Foyer').map(({ name }) => name)).toEqual(['Foyer', 'Stair']);
  expect(renamed([HALL, stair], 'Hall', 'Hall')).toEqual([HALL, stair]);
  expect(renamed([HALL, stair], 'Hall', 'Stair')[0].name).toBe('Stair (2)');
});

test('a view is that of the scene, and opens in the plan that is shown', () => {
  expect(viewsKey({ file: 'house.ifc', sha256: 'abc' })).toBe('tlsplan-views abc');
  expect(viewsKey({ file: 'memory', sha256: '' })).toBe('tlsplan-views memory');
  const hash = hashToKeep('#plan=runs/R001/plan&floor=F1&layer=range', [1, 2, 3, 4, 5, 6]);
  expect(hash).toBe('#floor=F1&layer=range&camera=1,2,3,4,5,6');
  const state = stateOfView({ name: '', hash }, '#plan=runs/R002/plan&floor=F0');
  expect(state).toMatchObject({ planBase: 'runs/R002/plan', floorId: 'F1' });
});
