import { expect, test } from 'vitest';
import { cloudPoint } from './cloud.ts';
import {
  ALL_BEAMS,
  CloudRows,
  readCloud,
  type ThinnedCloud,
  type Thinning,
  thinnedBeams,
  thinningFor,
} from './cloud-rows.ts';
import { PlanLoadError } from './plan-load-error.ts';
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

function read(
  buffer: ArrayBuffer,
  station: StageStation,
  thinning: Thinning = ALL_BEAMS,
  pieceBytes = 1e9,
): ThinnedCloud {
  const rows = new CloudRows(station, thinning);
  const all = new Uint8Array(buffer);
  for (let at = 0; at < all.length; at += pieceBytes) rows.push(all.subarray(at, at + pieceBytes));
  return rows.finish();
}

test('cloud points lie where range, elevation and azimuth say', () => {
  const { cloud, beams } = read(bytes(), STATION);
  expect(cloud.nReturns).toBe(2);
  const [a, b] = [cloudPoint(cloud, beams, 0, 1)!, cloudPoint(cloud, beams, 1, 2)!];
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
  const { cloud, beams } = read(bytes(), station);
  // Column 1 of row 0 at -30 + 60 degrees, column 2 of row 1 at 90 + 120.
  const [a, b] = [cloudPoint(cloud, beams, 0, 1)!, cloudPoint(cloud, beams, 1, 2)!];
  expect(Math.atan2(a[1], a[0])).toBeCloseTo(Math.PI / 6, 6);
  expect(Math.atan2(b[1], b[0])).toBeCloseTo((-5 * Math.PI) / 6, 6);
});

test('beams without a return are no points', () => {
  const { cloud, beams } = read(bytes(), STATION);
  expect(cloudPoint(cloud, beams, 0, 0)).toBeNull();
});

test('a file of another size is told with both sizes', () => {
  for (const n of [0, 23, 25]) expect(() => read(new ArrayBuffer(n), STATION)).toThrow(PlanLoadError);
  expect(() => read(new ArrayBuffer(23), STATION)).toThrow(/23 bytes, expected 24 for 2 x 4/);
});

test.each([
  [1, 1],
  [2, 2],
  [1, 3],
  [5, 2],
])('of a cloud every %ith row and %ith column is kept, in whatever pieces it comes', (everyRow, everyColumn) => {
  const [rows, columns] = [7, 11];
  const station = { ...STATION, cloudRows: rows, cloudColumns: columns, elevationsRad: new Float32Array(rows) };
  const all = new Uint8Array(3 * rows * columns).map((_, i) => (i * 37 + 5) % 251);
  const ranges = new Uint16Array(all.slice(0, 2 * rows * columns).buffer);
  for (const pieceBytes of [1, 13, 22, 1000]) {
    const { cloud } = read(all.buffer, station, { everyRow, everyColumn }, pieceBytes);
    const expected: [number, number][] = [];
    for (let row = 0; row < rows; row += everyRow) {
      for (let column = 0; column < columns; column += everyColumn) {
        const beam = row * columns + column;
        expected.push([ranges[beam], all[2 * rows * columns + beam]]);
      }
    }
    expect([...cloud.rangeSteps]).toEqual(expected.map(([range]) => range));
    expect([...cloud.intensity]).toEqual(expected.map(([, intensity]) => intensity));
  }
});

test('a packed cloud is the one that older plans have as it is', async () => {
  const all = new Uint8Array(bytes());
  const ranges = new Uint16Array(all.slice(0, 16).buffer);
  const less = (_: number, i: number, from: ArrayLike<number>): number => (i % 4 ? from[i] - from[i - 1] : from[i]);
  const differences = [Uint16Array.from(ranges, (v, i) => less(v, i, ranges)), all.subarray(16).map(less)];
  const packed = await new Response(
    new Blob(differences).stream().pipeThrough(new CompressionStream('deflate')),
  ).blob();
  const station = { ...STATION, cloudUri: 'clouds/S001.cloud' };
  expect(await readCloud(packed.stream(), station, ALL_BEAMS, true)).toEqual(read(bytes(), STATION));
  expect(await readCloud(new Blob([bytes()]).stream(), STATION, ALL_BEAMS, false)).toEqual(read(bytes(), STATION));
  for (const wrong of [packed.slice(0, 12), new Blob(['nothing deflated']), new Blob()])
    await expect(readCloud(wrong.stream(), station, ALL_BEAMS, true)).rejects.toThrow(/S001\.cloud: damaged/);
});

test('a thinned cloud keeps its directions', () => {
  const station = { ...STATION, azimuthsRad: Float32Array.of(0.25, 0.5) };
  const beams = thinnedBeams(station, { everyRow: 2, everyColumn: 2 });
  expect([beams.rows, beams.columns, beams.azimuthStepRad]).toEqual([1, 2, Math.PI]);
  expect([...beams.azimuthsRad]).toEqual([0.25]);
});

test('clouds are thinned no more than the number of points asks', () => {
  const station = { ...STATION, cloudRows: 1000, cloudColumns: 2000 };
  expect(thinningFor(station, 1, 2_000_000)).toEqual(ALL_BEAMS);
  // Half of the beams are enough to leave out.
  expect(thinningFor(station, 1, 1_999_999)).toEqual({ everyRow: 1, everyColumn: 2 });
  expect(thinningFor(station, 1, 999_999)).toEqual({ everyRow: 2, everyColumn: 2 });
  expect(thinningFor(station, 20, 8_000_000)).toEqual({ everyRow: 2, everyColumn: 3 });
});
