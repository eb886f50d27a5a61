/** Clouds: what share of the scans is drawn, more of it closer by, and a key that switches stations on and off. */
import type { Page } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test } from 'vitest';
import { ViewerPage } from './browser.ts';
import { countGl, glCount } from './gl-meter.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const own = ownCopy(planFolder);
let viewer: ViewerPage;
let page: Page;

beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 1280, height: 800 });
  page = viewer.page;
  await countGl(page);
});
afterEach(async () => {
  await page.close();
  expect(viewer.faults).toEqual([]);
});

const shown = () => page.locator('[data-testid=cloud][data-state=shown]');

test('all clouds are told apart by station, with a key that switches each', { tags: 'main' }, async () => {
  const floor = plan.floors[0].id;
  const here = plan.stations.filter((station) => station.floor === floor);
  await viewer.open(`#floor=${floor}`);
  await page.getByRole('button', { name: 'Clouds' }).click();
  await shown().waitFor();
  const key = page.getByRole('list', { name: 'Clouds by station' });
  expect(await key.getByRole('checkbox').count()).toBe(here.length);
  // Half of the beams of the lidar are in its previews, and that is said.
  expect(await shown().textContent()).toMatch(new RegExp(`from ${here.length} stations: 1 beam in 2 drawn`));
  await viewer.settle();
  const all = await viewer.canvasPixels();
  await viewer.screenshot('clouds-all');
  const before = await glCount(page);
  await key.getByLabel(here[0].id).uncheck();
  await expect.poll(() => shown().textContent()).toContain(`from ${here.length - 1} stations`);
  await viewer.settle();
  expect(all.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.001);
  expect((await glCount(page)).bytes).toBeLessThan(before.bytes);
  await page.getByRole('button', { name: 'None' }).click();
  await shown().waitFor({ state: 'detached' });
  await key.getByLabel(here[1].id).check();
  await expect.poll(() => shown().textContent()).toContain('returns: 1 beam in 2 drawn');
  await viewer.screenshot('clouds-one-of-all');
  await page.getByRole('button', { name: 'All', exact: true }).click();
  await expect.poll(() => shown().textContent()).toContain(`from ${here.length} stations`);
});

test('closer by, the live server gives all beams of what is looked at', async () => {
  const [station] = plan.stations;
  await viewer.open(`#floor=${station.floor}&station=${station.id}`);
  await shown().waitFor();
  await viewer.settle();
  // Inside the room, beside the sensor: what is looked at is a part of the scan.
  const [x, y, z] = station.position;
  const camera = [x + 0.3, y, z + 0.2, x - 1.5, y, z];
  await page.evaluate((hash) => {
    window.location.hash = hash;
  }, `#floor=${station.floor}&station=${station.id}&camera=${camera.join()}`);
  await page.getByTestId('cloud-detail').waitFor();
  expect(await page.getByTestId('cloud-detail').textContent()).toBe(`Closer, from ${station.id}: all beams`);
  await viewer.settle();
  await viewer.screenshot('clouds-closer');
  await page.getByRole('button', { name: '3D' }).click();
  await page.getByTestId('cloud-detail').waitFor({ state: 'detached' });
});
