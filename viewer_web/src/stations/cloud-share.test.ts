import { expect, test } from 'vitest';
import { beamsOfScan, shareInWords } from './cloud-share.ts';

test.each([
  [288_000, 288_000, 'all beams'],
  [200_000, 256_000, '78.1 % of the beams'],
  [255_999, 256_000, 'just below 100 % of the beams'],
  [144_000, 288_000, '1 beam in 2'],
  [100, 250, '1 beam in 2.5'],
  [190_605, 45_699_808, '1 beam in 240'],
  [10, 100_000, '1 beam in 10,000'],
])('%i beams of %i are told as %s', (nBeams, nScanned, words) => {
  expect(shareInWords(nBeams, nScanned)).toBe(words);
});

test('a scan has a beam for each channel at each azimuth', () => {
  expect(beamsOfScan({ n_azimuths: 4500, n_channels: 64 })).toBe(288_000);
});
