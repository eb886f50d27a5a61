/** Clouds closer by: the live server sends all beams of what is in view. */
import { expect, inject, test } from 'vitest';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground, stationsOf } = new PlanFiles(inject('planFolder'));
const [station] = plan.stations;
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

test('from above the next stop of the route gets its beams straight down too, without a message; a link shows the same', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  // At the top of the stairs, above all that is in view: the part of its scan that is looked at ends straight down.
  const { id: stop } = stationsOf(ground.id).reduce((a, b) => (a.position[2] > b.position[2] ? a : b));
  const order = plan.route!.order;
  await viewer.open(`#station=${order[order.indexOf(stop) - 1]}`);
  await viewer.press('t');
  await page.getByLabel('Show route').check();
  const [answer] = await Promise.all([
    page.waitForResponse((response) => response.url().includes(`${stop}/cloud-window`)),
    page.getByRole('button', { name: 'Next ›' }).click(),
  ]);
  expect(Number(new URL(answer.url()).searchParams.get('low'))).toBeCloseTo(-Math.PI / 2, 4);
  expect(answer.status()).toBe(200);
  await page.getByTestId('cloud-detail').waitFor();
  await expect.poll(() => page.getByRole('alert').count()).toBe(0);

  await page.getByRole('button', { name: 'Share' }).click();
  await page.getByRole('button', { name: 'Copy link' }).click();
  const link = await page.getByRole('textbox', { name: 'Link to this view' }).inputValue();
  const cameraOf = (address: string): number[] =>
    (new URLSearchParams(new URL(address).hash.slice(1)).get('camera') ?? '').split(',').map(Number);
  const [x, y, z, ...target] = cameraOf(link);
  expect([x, y]).toEqual(target.slice(0, 2).map((m) => expect.closeTo(m, 1)));
  expect(z).toBeGreaterThan(target[2] + 5);
  await page.goto('about:blank');
  await page.goto(link);
  await page.getByTestId('cloud-detail').waitFor();
  await expect.poll(async () => cameraOf(page.url())).toEqual([x, y, z, ...target]);
});
