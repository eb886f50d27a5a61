import { expect, test } from 'vitest';
import { cloudPoint, decodeCloud } from './cloud.ts';
import type { StageStation } from './stage.ts';

const STATION: StageStation = {
  id: 'S001',
  floorId: 'F0',
  order: 1,
  positionM: [0, 0, 1.3],
  cloudUri: 'clouds/S001.u16',
  cloudRows: 2,
  cloudColumns: 4,
  rangeStepM: 5 / 65535,
  elevationsRad: Float32Array.of(0, -Math.PI / 6),
  azimuthsRad: Float32Array.of(0, 0),
  azimuthStepRad: Math.PI / 2,
};

/** Range 2 m at elevation 0, azimuth 90 degrees; 5 m at -30 degrees, azimuth 180; nothing else. */
function bytes(): ArrayBuffer {
  const buffer = new ArrayBuffer(24);
  const view = new DataView(buffer);
  view.setUint16(2 * 1, Math.round((2 / 5) * 65535), true);
  view.setUint16(2 * 6, 65535, true);
  view.setUint8(16 + 1, 255);
  view.setUint8(16 + 6, 51);
  return buffer;
}

test('cloud points lie where range, elevation and azimuth say', () => {
  const cloud = decodeCloud(bytes(), STATION);
  expect(cloud.nReturns).toBe(2);
  const [a, b] = [cloudPoint(cloud, STATION, 0, 1)!, cloudPoint(cloud, STATION, 1, 2)!];
  const halfStepM = STATION.rangeStepM / 2;
  [0, 2, 0].forEach((x, i) => {
    expect(Math.abs(a[i] - x)).toBeLessThanOrEqual(halfStepM + 1e-9);
  });
  [-5 * Math.cos(Math.PI / 6), 0, -2.5].forEach((x, i) => {
    expect(Math.abs(b[i] - x)).toBeLessThanOrEqual(halfStepM + 1e-6);
  });
  expect([cloud.intensity[1], cloud.intensity[6]]).toEqual([255, 51]);
});

test('rows begin at their own azimuths', () => {
  const station = { ...STATION, azimuthsRad: Float32Array.of(-Math.PI / 6, Math.PI / 2), azimuthStepRad: Math.PI / 3 };
  const cloud = decodeCloud(bytes(), station);
  // Column 1 of row 0 at -30 + 60 degrees, column 2 of row 1 at 90 + 120.
  const [a, b] = [cloudPoint(cloud, station, 0, 1)!, cloudPoint(cloud, station, 1, 2)!];
  expect(Math.atan2(a[1], a[0])).toBeCloseTo(Math.PI / 6, 6);
  expect(Math.atan2(b[1], b[0])).toBeCloseTo((-5 * Math.PI) / 6, 6);
});

test('beams without a return are no points', () => {
  expect(cloudPoint(decodeCloud(bytes(), STATION), STATION, 0, 0)).toBeNull();
});

test('a file of another size is told with both sizes', () => {
  expect(() => decodeCloud(new ArrayBuffer(23), STATION)).toThrow(/23 bytes, expected 24 for 2 x 4/);
});
