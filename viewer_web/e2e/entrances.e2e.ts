/** Entrances set and doors marked in a real browser, by mouse and by keys, and the route that begins where one enters. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Locator } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test } from 'vitest';
import type { DraftRoute, Review } from '../src/api/documents.ts';
import { type Door, doorsOf } from '../src/edit/doors.ts';
import { readStage } from '../src/load/stage.ts';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const stations = plan.stations.filter((station) => station.floor === floor.id);
const stage = readStage(Uint8Array.from(readFileSync(join(planFolder, 'viewer', 'stage.usdc'))).buffer);
const doors = doorsOf(stage).filter(({ element }) => element.floorId === floor.id);

const own = ownCopy(planFolder);
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 1280, height: 800 });
  await viewer.open(`#floor=${floor.id}&tab=edit`);
  await viewer.page.keyboard.press('p');
  await viewer.page.getByTestId('plan-scale').waitFor();
  await viewer.page.getByTestId('live-note').waitFor({ state: 'detached' });
  await viewer.settle();
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

const review = (): Promise<Review> =>
  viewer.page.evaluate(async () => (await fetch('api/review')).json()) as Promise<Review>;
const tool = (name: string): Promise<void> => viewer.page.getByRole('radio', { name, exact: true }).click();
const changes = (): Locator => viewer.page.getByRole('list', { name: 'Changes' }).locator('li');

async function centreOf(id: string): Promise<[number, number]> {
  const box = (await viewer.page.locator(`.marker[data-station="${id}"]`).boundingBox())!;
  return [box.x + box.width / 2, box.y + box.height / 2];
}

/** Where a place (x, y, scene frame) is on the page. Straight from above one scale holds everywhere, and north is up. */
async function onPage([x, y]: readonly number[]): Promise<[number, number]> {
  const [a, b] = [stations[0], stations.reduce((far, one) => (awayOf(one) > awayOf(far) ? one : far))];
  const [[ax, ay], [bx, by]] = [await centreOf(a.id), await centreOf(b.id)];
  const pixelsPerM = Math.hypot(bx - ax, by - ay) / awayOf(b);
  return [ax + (x - a.position[0]) * pixelsPerM, ay - (y - a.position[1]) * pixelsPerM];
}
const awayOf = ({ position }: { position: readonly number[] }): number =>
  Math.hypot(position[0] - stations[0].position[0], position[1] - stations[0].position[1]);

function middleOf({ lowM, highM }: Door): number[] {
  return [0, 1].map((k) => (lowM[k] + highM[k]) / 2 + stage.offsetM[k]);
}

test('the route begins where an entrance is clicked, and without it where it did', { tags: 'main' }, async () => {
  const { page } = viewer;
  const last = stations.at(-1)!;
  await tool('Entrance');
  const [x, y] = await onPage([last.position[0] + 0.35, last.position[1]]);
  const before = (await viewer.canvasPixels()).at(x, y);
  await page.mouse.click(x, y);
  await expect.poll(async () => Object.keys((await review()).entrances)).toEqual(['E001']);
  const { E001: entrance } = (await review()).entrances;
  expect(entrance.floor).toBe(floor.id);
  expect(
    Math.hypot(entrance.position_m[0] - last.position[0] - 0.35, entrance.position_m[1] - last.position[1]),
  ).toBeLessThan(0.15);
  expect(entrance.position_m[2]).toBeCloseTo(floor.elevation_m, 1);
  await page.getByText('the route begins here').waitFor();
  await viewer.settle();
  expect((await viewer.canvasPixels()).at(x, y)).not.toEqual(before);
  await viewer.screenshot('entrance-1-set');

  await page.getByRole('tab', { name: 'Plan' }).click();
  const answer = page.waitForResponse((response) => response.url().endsWith('api/live/route'));
  await page.getByLabel('Show route').check();
  const { route } = (await (await answer).json()) as DraftRoute;
  expect(Math.hypot(...[0, 1].map((k) => route!.start![k] - entrance.position_m[k]))).toBeLessThan(0.3);
  expect(route!.legs[0].to).toBe(last.id);
  await viewer.settle();
  await viewer.screenshot('entrance-2-route');

  await page.getByRole('tab', { name: 'Edit' }).click();
  await page.getByRole('button', { name: 'Remove: Entrance' }).click();
  await expect.poll(async () => Object.keys((await review()).entrances)).toEqual([]);
  await page.keyboard.press('Control+z');
  await expect.poll(async () => Object.keys((await review()).entrances)).toEqual(['E001']);
  await page.keyboard.press('Control+Shift+z');
  await expect.poll(async () => Object.keys((await review()).entrances)).toEqual([]);
});

test('an entrance is set by keys', async () => {
  const { page } = viewer;
  // The cross shows where the focus came by keys.
  await page.getByRole('radio', { name: 'Entrance', exact: true }).press('Enter');
  await page.locator('canvas').first().focus();
  await page.getByText('Arrows move the cross, Space clicks there.').waitFor();
  const toM = [stations.at(-1)!.position[0] + 0.35, stations.at(-1)!.position[1]];
  const [x, y] = await onPage(toM);
  for (let i = 0; i < 200; i++) {
    const box = (await page.locator('.key-cursor').boundingBox())!;
    const [dx, dy] = [x - box.x - box.width / 2, y - box.y - box.height / 2];
    if (Math.max(Math.abs(dx), Math.abs(dy)) < 12) break;
    if (Math.abs(dx) > Math.abs(dy)) await page.keyboard.press(dx > 0 ? 'ArrowRight' : 'ArrowLeft');
    else await page.keyboard.press(dy > 0 ? 'ArrowDown' : 'ArrowUp');
  }
  await page.keyboard.press('Space');
  await expect.poll(async () => Object.keys((await review()).entrances).length).toBe(1);
  expect(Object.values((await review()).entrances).map((one) => one.floor)).toEqual([floor.id]);
  await page.getByRole('button', { name: 'Remove: Entrance' }).press('Enter');
  await expect.poll(() => changes().count()).toBe(0);
});

test('doors are marked open and shut by a click, and live figures stay those of the plan', {
  tags: 'main',
}, async () => {
  const { page } = viewer;
  const [first, second] = doors;
  await tool('Doors');
  await page.getByText('Live figures take doors as planned until you plan again.').waitFor();
  const figures = await page.getByTestId('totals').textContent();
  await page.mouse.click(...(await onPage(middleOf(first))));
  const id = first.element.sourceId;
  await expect.poll(async () => (await review()).doors).toEqual({ [id]: 'open' });
  await page.getByTestId('doors-note').waitFor();
  expect(await changes().allTextContents()).toEqual([
    `${first.element.name}: openin the next plan, ${floor.name}As planned`,
  ]);
  await page.mouse.click(...(await onPage(middleOf(first))));
  await page.getByText('This door is marked as open already.').waitFor();

  await page.getByRole('radio', { name: 'Shut', exact: true }).click();
  await page.mouse.click(...(await onPage(middleOf(first))));
  await expect.poll(async () => (await review()).doors).toEqual({ [id]: 'shut' });
  await page.mouse.click(...(await onPage(middleOf(second))));
  await expect.poll(async () => (await review()).doors).toEqual({ [id]: 'shut', [second.element.sourceId]: 'shut' });
  await viewer.settle();
  await viewer.screenshot('entrance-3-doors');
  expect(await page.getByTestId('totals').textContent()).toBe(figures);

  await page.keyboard.press('Control+z');
  await expect.poll(async () => (await review()).doors).toEqual({ [id]: 'shut' });
  await page.keyboard.press('Control+z');
  await expect.poll(async () => (await review()).doors).toEqual({ [id]: 'open' });
  await page.getByRole('button', { name: /^As planned: / }).click();
  await expect.poll(async () => (await review()).doors).toEqual({});
  await page.getByTestId('doors-note').waitFor({ state: 'detached' });
});

test('a click beside all doors marks none and says so', async () => {
  const { page } = viewer;
  const { revision } = await review();
  await tool('Doors');
  const [{ position }] = stations;
  await page.mouse.click(...(await onPage([position[0] + 0.35, position[1]])));
  await page.getByText('No door there: click on one.').waitFor();
  expect((await review()).revision).toBe(revision);
});
