import { expect, test } from 'vitest';
import { facingOf } from './section/planes.ts';
import { formatUrlState, NO_STATE, parseUrlState } from './url-state.ts';

test.each([
  {},
  { floorId: 'F1' },
  { stationId: 'S012' },
  { floorId: 'Étage & 1 = #2', stationId: 'S 1+1' },
  { layerId: 'range', tab: 'network', pair: ['S,1', 'S&2'] as const },
  { planBase: 'runs/R001/plan', compareBase: 'runs/R002/plan' },
  { camera: [1.25, -2, 3, 0, 0.5, 1e4] },
  { camera: [1, 2, 3, 2, 2, 3], isWalking: true },
  { hiddenFiles: [0, 12] },
  { sectionBox: { minM: [-1, 0, 0.5], maxM: [4, 5, 2.25] } as const },
  { sectionLine: { fromM: [0, 1], toM: [5, 1], isFlipped: false } as const, shows: ['square'] as const },
  { cutM: 2.35, shows: ['links', 'route', 'open'] as const },
])('a view written to the address is read back: %o', (part) => {
  const state = { ...NO_STATE, ...part };
  expect(parseUrlState(formatUrlState(state))).toEqual(state);
});

test('an address that says nothing or nonsense is the default view', () => {
  for (const hash of [
    '',
    '#',
    '#floor=',
    '#%%%',
    '#a=b',
    '#pair=S001',
    '#camera=1,2,3',
    '#camera=1,2,3,4,5,x',
    '#cut=x',
    '#cut=-1',
    '#show=all',
    '#without=x,-1',
    '#box=1,2,3,4,5',
    '#box=1,2,3,1,2,3',
    '#line=1,2,1,2',
  ]) {
    expect(parseUrlState(hash), hash).toEqual(NO_STATE);
  }
});

test('folders in the address are legible', () => {
  expect(formatUrlState({ ...NO_STATE, planBase: 'runs/R001/plan' })).toBe('#plan=runs/R001/plan');
});

test('a line that is flipped keeps the same side when it is read', () => {
  const flipped = { fromM: [0, 1], toM: [5, 3], isFlipped: true } as const;
  const { sectionLine } = parseUrlState(formatUrlState({ ...NO_STATE, sectionLine: flipped }));
  expect(facingOf(sectionLine!)).toEqual(facingOf(flipped));
});
