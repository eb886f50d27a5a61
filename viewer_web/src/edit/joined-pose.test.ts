import { expect, test } from 'vitest';
import type { Pose } from './changes.ts';
import type { DraftStation } from './draft.ts';
import { joinedPose } from './joined-pose.ts';

const BEFORE: DraftStation = {
  id: 'S001',
  floorId: 'F0',
  number: 1,
  order: 1,
  positionM: [10, 20, 3.5],
  instrumentHeightM: 1.5,
  isFixed: false,
  isLocked: false,
  isRemoved: false,
  isAdded: false,
  movedFromM: null,
};
const MOVED: Pose = { position_m: [11, 21, 3.5], instrument_height_m: 1.5, floor: 'F0' };
const RAISED: Pose = { position_m: [10, 20, 3.7], instrument_height_m: 1.7, floor: 'F0' };
const asTheirs = (pose: Pose): DraftStation => ({
  ...BEFORE,
  positionM: pose.position_m,
  instrumentHeightM: pose.instrument_height_m,
  floorId: pose.floor,
});

test('my place and their height are both kept, and the sensor stands on the ground of my place', () => {
  // My ground is 2.1 m high, theirs 2.0: their height counts from mine.
  const mine: Pose = { ...MOVED, position_m: [11, 21, 3.6] };
  expect(joinedPose(BEFORE, mine, asTheirs(RAISED))).toEqual({
    position_m: [11, 21, expect.closeTo(3.8)],
    instrument_height_m: 1.7,
    floor: 'F0',
  });
});

test('my height and their place are both kept, on their floor', () => {
  const theirs = asTheirs({ position_m: [40, 50, 7.5], instrument_height_m: 1.5, floor: 'F1' });
  expect(joinedPose(BEFORE, RAISED, theirs)).toEqual({
    position_m: [40, 50, expect.closeTo(7.7)],
    instrument_height_m: 1.7,
    floor: 'F1',
  });
});

test.each([
  ['both moved it', MOVED, asTheirs({ ...MOVED, position_m: [12, 20, 3.5] })],
  ['both raised it', RAISED, asTheirs({ ...RAISED, instrument_height_m: 1.8 })],
  ['they did both', MOVED, asTheirs({ ...MOVED, instrument_height_m: 1.8 })],
  ['I did both', { ...MOVED, instrument_height_m: 1.6 }, asTheirs(RAISED)],
  ['they removed it', MOVED, { ...asTheirs(RAISED), isRemoved: true }],
  ['they locked it', MOVED, { ...asTheirs(RAISED), isLocked: true }],
  ['nobody knows its height', MOVED, { ...asTheirs(RAISED), instrumentHeightM: null }],
] as const)('there is nothing to join where %s', (_, mine, theirs) => {
  expect(joinedPose(BEFORE, mine, theirs)).toBeNull();
});
