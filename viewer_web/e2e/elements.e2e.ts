/** Elements in a real browser: found by search, their GlobalId copied, drawn alone and through the others. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expect, inject, test } from 'vitest';
import { rgbOf } from '../src/heat/colors.ts';
import { readStage } from '../src/load/stage.ts';
import { LIGHT } from '../src/scene/palette.ts';
import { viewerPages } from './browser.ts';

const stage = readStage(new Uint8Array(readFileSync(join(inject('planFolder'), 'viewer/stage.usdc'))).buffer);
const openPage = viewerPages({ width: 1280, height: 800 });

test('an element is found by name and by GlobalId, and drawn alone and as in an x-ray', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open();
  const wall = stage.elements.find(({ kind, floorId }) => kind.startsWith('IfcWall') && floorId !== '')!;
  const search = page.getByRole('searchbox', { name: 'Search elements' });
  const found = page.getByRole('list', { name: 'Elements found' }).getByRole('button');
  await search.fill('no such thing');
  await expect.poll(() => found.count()).toBe(0);
  await search.fill(wall.sourceId);
  await expect.poll(() => found.allTextContents()).toHaveLength(1);
  await search.fill(wall.name);
  await found.first().click();
  const card = page.getByRole('complementary', { name: 'Clicked surface' });
  await expect.poll(() => card.getByRole('heading', { level: 2 }).textContent()).toBe(wall.name);
  await expect.poll(() => card.locator('.source-id').textContent()).toBe(wall.sourceId);
  await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await card.getByRole('button', { name: 'Copy' }).click();
  await card.getByRole('button', { name: 'Copied' }).waitFor();
  expect(await page.evaluate(() => navigator.clipboard.readText())).toBe(wall.sourceId);

  await viewer.settle();
  const whole = await viewer.canvasPixels();
  const drawn = (pixels: typeof whole) =>
    pixels.share((rgb) => rgb.some((value, k) => Math.abs(value - rgbOf(LIGHT.background)[k]) > 8));
  await card.getByRole('button', { name: 'Isolate' }).click();
  await viewer.settle();
  const alone = drawn(await viewer.canvasPixels());
  await viewer.screenshot('element-alone');
  expect(alone).toBeGreaterThan(0.002);
  expect(alone).toBeLessThan(0.6 * drawn(whole));
  await card.getByRole('button', { name: 'X-ray' }).click();
  await viewer.settle();
  const xray = drawn(await viewer.canvasPixels());
  await viewer.screenshot('element-xray');
  expect(xray).toBeGreaterThan(alone);
  expect(xray).toBeLessThan(0.9 * drawn(whole));
  await card.getByRole('button', { name: 'Close' }).click();
  await viewer.settle();
  await expect.poll(async () => drawn(await viewer.canvasPixels())).toBeGreaterThan(0.9 * drawn(whole));
});
