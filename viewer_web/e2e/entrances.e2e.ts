/** Entrances and doors in a real browser: set by keys, and clicks beside all doors. */
import { expect, inject, test } from 'vitest';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const stations = stationsOf(floor.id);
const openPage = viewerPages({ width: 1280, height: 800 });

test('an entrance is set by keys, and a click beside all doors marks none', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.openEditing(`floor=${floor.id}`, 'p');
  const onPage = async (x: number, y: number) => (await viewer.planToPage(stations))(x, y);
  const entrances = async () => Object.values((await viewer.review()).entrances);
  // The cross shows where the focus came by keys.
  await page.getByRole('radio', { name: 'Entrance', exact: true }).press('Enter');
  await page.locator('canvas').first().focus();
  await page.getByText('Arrows move the cross, Space clicks there.').waitFor();
  const last = stations.at(-1)!;
  const [x, y] = await onPage(last.position[0] + 0.35, last.position[1]);
  for (let i = 0; i < 200; i++) {
    const box = (await page.locator('.key-cursor').boundingBox())!;
    const [dx, dy] = [x - box.x - box.width / 2, y - box.y - box.height / 2];
    if (Math.max(Math.abs(dx), Math.abs(dy)) < 12) break;
    if (Math.abs(dx) > Math.abs(dy)) await page.keyboard.press(dx > 0 ? 'ArrowRight' : 'ArrowLeft');
    else await page.keyboard.press(dy > 0 ? 'ArrowDown' : 'ArrowUp');
  }
  await page.keyboard.press('Space');
  await expect.poll(async () => (await entrances()).map((one) => one.floor)).toEqual([floor.id]);
  await page.getByRole('button', { name: 'Remove: Entrance' }).press('Enter');
  await expect.poll(entrances).toEqual([]);

  const { revision } = await viewer.review();
  await viewer.tool('Doors');
  await page.mouse.click(...(await onPage(stations[0].position[0] + 0.35, stations[0].position[1])));
  await page.getByText('No door there: click on one.').waitFor();
  expect((await viewer.review()).revision).toBe(revision);
});
