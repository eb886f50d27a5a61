/** Clouds closer by: the live server sends all beams of what is in view. */
import { expect, inject, test } from 'vitest';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const [station] = new PlanFiles(inject('planFolder')).plan.stations;
const openPage = viewerPages({ width: 960, height: 600 });

test('closer by, the live server gives all beams of what is in view', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  const hash = `#floor=${station.floor}&station=${station.id}`;
  await viewer.open(hash);
  await page.locator('[data-testid=cloud][data-state=shown]').waitFor();
  // Inside the room, beside the sensor: a part of the scan is in view.
  const [x, y, z] = station.position;
  await viewer.open(`${hash}&camera=${[x + 0.3, y, z + 0.2, x - 1.5, y, z].join()}`);
  const detail = page.getByTestId('cloud-detail');
  await detail.waitFor();
  await expect.poll(() => detail.textContent()).toBe(`Closer, from ${station.id}: all beams`);
  await page.getByRole('button', { name: '3D' }).click();
  await detail.waitFor({ state: 'detached' });
});
