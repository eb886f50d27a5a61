import { expect, test } from 'vitest';
import { AreaOverlay, circle, filled, rimOf } from './area-overlay.ts';
import type { Place } from './ground-map.ts';
import { areaM2 } from './outline.ts';

const BENT: Place[] = [
  [0, 0],
  [4, 0],
  [4, 4],
  [2, 1],
  [0, 4],
];

test('an outline is filled with its own area, bent inwards or not', () => {
  const corners = filled(BENT, 1.5);
  let sum = 0;
  for (let i = 0; i < corners.length; i += 9) {
    sum += areaM2([
      [corners[i], corners[i + 1]],
      [corners[i + 3], corners[i + 4]],
      [corners[i + 6], corners[i + 7]],
    ]);
    expect([corners[i + 2], corners[i + 5], corners[i + 8]]).toEqual([1.5, 1.5, 1.5]);
  }
  expect(sum).toBeCloseTo(areaM2(BENT), 6);
});

test('a circle has its radius and nearly its area', () => {
  const outline = circle([1000, -5], 0.5);
  for (const [x, y] of outline) expect(Math.hypot(x - 1000, y + 5)).toBeCloseTo(0.5, 9);
  expect(areaM2(outline)).toBeGreaterThan(0.99 * Math.PI * 0.25);
});

test('areas of floors that are not shown are not drawn, and those of lifted ones are lifted', () => {
  const overlay = new AreaOverlay();
  const area = { kind: 'keep_out' as const, heightM: 0, outline: BENT };
  overlay.set(
    [
      { ...area, floorId: 'F0' },
      { ...area, floorId: 'F1' },
    ],
    (floorId) => (floorId === 'F1' ? 7 : null),
  );
  expect(overlay.group.children.length).toBeGreaterThan(0);
  for (const object of overlay.group.children) expect(object.position.z).toBeCloseTo(7.03, 6);
  overlay.set([], () => 0);
  expect(overlay.group.children).toEqual([]);
});

test('the rim of marked ground is a band inside its outline, and leaves its middle free', () => {
  const corners = filled(
    [
      [0, 0],
      [4, 0],
      [4, 3],
      [0, 3],
    ],
    1,
  );
  const rim = rimOf(corners);
  let sum = 0;
  for (let i = 0; i < rim.length; i += 9) {
    const places = [0, 3, 6].map((k): Place => [rim[i + k], rim[i + k + 1]]);
    sum += areaM2(places);
    for (const [x, y] of places) expect(Math.min(x, 4 - x, y, 3 - y)).toBeLessThan(0.081);
    for (const [x, y] of places) expect(Math.min(x, 4 - x, y, 3 - y)).toBeGreaterThan(-1e-6);
  }
  expect(sum).toBeCloseTo(0.08 * 14, 5);
  const overlay = new AreaOverlay();
  const drawn = (isRimAlone: boolean): number => {
    overlay.set([{ kind: 'ground', floorId: 'F0', heightM: 0, cornersM: corners, isRimAlone }], () => 0);
    return overlay.group.children.length;
  };
  expect([drawn(true), drawn(false)]).toEqual([1, 2]);
});
