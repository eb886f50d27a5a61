import { expect, test } from 'vitest';
import { crowdedMarkers } from './crowding.ts';

test('markers that lie on an earlier one are crowded, and no others', () => {
  const at = (id: string, x: number, y: number) => ({ id, x, y });
  const crowded = crowdedMarkers([at('a', 0, 0), at('b', 10, 5), at('c', 35, 0), at('d', 0, 30), at('e', 20, 0)], 1);
  expect([...crowded]).toEqual(['b', 'e']);
});

test('no two that keep their numbers overlap, and every crowded one lies on one of them', () => {
  let state = 7;
  const next = (): number => {
    state = (Math.imul(state, 1103515245) + 12345) & 0x7fffffff;
    return state / 0x7fffffff;
  };
  const markers = [...Array(300).keys()].map((i) => ({ id: `S${i}`, x: 900 * next() - 100, y: 700 * next() - 50 }));
  const crowded = crowdedMarkers(markers, 1);
  const overlap = (a: { x: number; y: number }, b: { x: number; y: number }): boolean =>
    Math.abs(a.x - b.x) < 30 && Math.abs(a.y - b.y) < 22;
  const kept = markers.filter(({ id }) => !crowded.has(id));
  for (const marker of markers) {
    const isOn = kept.some((other) => other !== marker && overlap(marker, other));
    expect(isOn, marker.id).toBe(crowded.has(marker.id));
  }
  expect(crowded.size).toBeGreaterThan(50);
});

test('as many numbers as may lie on each other keep theirs, those named first', () => {
  const markers = [...Array(9).keys()].map((i) => ({ id: `S${i}`, x: 40 + i, y: 40 }));
  expect([...crowdedMarkers(markers, 7)]).toEqual(['S7', 'S8']);
});
