/** What people take along: a picture, and a link that shows the same view. */
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { expect, test } from 'vitest';
import { viewerPages } from './browser.ts';

const PICTURE = fileURLToPath(new URL('../test-results/share-picture.png', import.meta.url));
const openPage = viewerPages({ width: 960, height: 600 });

test('a picture has the scene with its title and legend, and a link shows the same: floor, layer and camera', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#floor=F1&layer=range');
  const home = await viewer.hash();
  await viewer.dragFrom([700, 320], 80, 30, 3);
  await page.mouse.up();
  await expect.poll(() => viewer.hash()).toContain('camera=');
  await expect.poll(() => viewer.hash()).not.toBe(home);
  await page.getByRole('button', { name: 'Share' }).click();
  const menu = page.getByRole('region', { name: 'Share and download' });
  const [download] = await Promise.all([
    page.waitForEvent('download'),
    menu.getByRole('button', { name: 'Picture' }).click(),
  ]);
  expect(download.suggestedFilename()).toBe('house-F1.png');
  await download.saveAs(PICTURE);
  const bytes = readFileSync(PICTURE);
  const { width, height } = (await page.locator('.scene').boundingBox())!;
  expect(bytes.subarray(1, 4).toString()).toBe('PNG');
  expect([bytes.readUInt32BE(16), bytes.readUInt32BE(20)]).toEqual([width, height + 56]);
  // Far more than a background: the building, numbers and texts are in it.
  expect(bytes.length).toBeGreaterThan(40_000);

  await menu.getByRole('button', { name: 'Copy link' }).click();
  const link = await menu.getByRole('textbox', { name: 'Link to this view' }).inputValue();
  expect(link).not.toContain('token');
  expect(new URL(link).hash).toMatch(/floor=F1.*layer=range.*camera=/);
  const before = await viewer.canvasPixels();
  await page.goto('about:blank');
  await page.goto(link);
  await page.locator('.marker:not([hidden])').first().waitFor();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  expect(before.shareChanged(await viewer.canvasPixels())).toBeLessThan(0.02);
});
