import { expect, test, vi } from 'vitest';
import { parseUrlState } from '../url-state.ts';
import { copied, linkTo } from './link.ts';

const at = (hash: string) => ({ origin: 'http://127.0.0.1:8000', pathname: '/clients/house/', hash });

test('a link has floor, station, layer and what else the address has, and the camera as it stands now', () => {
  const link = linkTo(at('#floor=F0&station=S003&layer=range&show=clouds&camera=9,9,9,9,9,9'), [1, 2, 3, 4, 5.5, 6]);
  const { origin, pathname, hash } = new URL(link);
  expect([origin, pathname]).toEqual(['http://127.0.0.1:8000', '/clients/house/']);
  expect(parseUrlState(hash)).toMatchObject({
    floorId: 'F0',
    stationId: 'S003',
    layerId: 'range',
    shows: ['clouds'],
    camera: [1, 2, 3, 4, 5.5, 6],
  });
});

test('a link has no token, though the address had one', () => {
  expect(linkTo(at(''), [0, 0, 0, 1, 1, 1])).not.toContain('token');
});

test('a page without a clipboard, or one that is refused it, is told so', async () => {
  const writeText = vi.fn(async () => undefined);
  expect(await copied('link', { writeText })).toBe(true);
  expect(writeText).toHaveBeenCalledWith('link');
  expect(await copied('link', undefined)).toBe(false);
  expect(await copied('link', { writeText: () => Promise.reject(new Error('denied')) })).toBe(false);
});
