/** Sections in a real browser: a box that is dragged, moved by keys and typed, and a vertical section along a line on the plan. */
import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, test } from 'vitest';
import { launchBrowser, ViewerPage } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const address = inject('address');
const { plan } = new PlanFiles(inject('planFolder'));
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const stations = plan.stations.filter((station) => station.floor === floor.id);

let browser: Browser;
let viewer: ViewerPage;
beforeAll(async () => {
  browser = await launchBrowser();
});
afterAll(() => browser.close());
beforeEach(async () => {
  viewer = await ViewerPage.create(browser, address, { width: 1280, height: 800 });
  await viewer.open(`#floor=${floor.id}`);
  await viewer.page.getByRole('button', { name: 'Section', exact: true }).click();
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

const side = (name: string) => viewer.page.getByRole('slider', { name: `${name} side of the section box` });
const field = (name: string) => viewer.page.getByLabel(`${name}, m`, { exact: true });
const placeOf = async (name: string): Promise<number> => Number(await side(name).getAttribute('aria-valuenow'));
const shownStations = (): Promise<string[]> =>
  viewer.page.locator('.marker:not([hidden])').evaluateAll((all) => all.map((one) => one.dataset.station ?? ''));

test('the box is dragged, moved by keys and typed, and takes away what is outside it, stations too', {
  tags: 'main',
}, async () => {
  const { page } = viewer;
  await page.getByRole('button', { name: 'Box', exact: true }).click();
  await viewer.settle();
  const all = await shownStations();
  expect(all.length).toBeGreaterThanOrEqual(stations.length);
  const whole = await viewer.canvasPixels();
  const before = await placeOf('South');
  const box = (await side('South').boundingBox())!;
  expect(Math.min(box.width, box.height)).toBeGreaterThanOrEqual(24);
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 6; i++) {
    await page.mouse.move(x - 5 * i, y - 16 * i);
    await viewer.settle();
  }
  await page.mouse.up();
  const dragged = await placeOf('South');
  expect(dragged).toBeGreaterThan(before + 1);
  expect(whole.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.05);
  await viewer.screenshot('s-box-dragged');

  await side('South').focus();
  await page.keyboard.press('ArrowUp');
  expect(await placeOf('South')).toBeCloseTo(dragged + 0.1, 2);
  expect(await page.getByLabel('Shown floor').inputValue()).toBe('');
  await field('South').fill('4.5');
  await field('South').press('Enter');
  await viewer.settle();
  expect(await placeOf('South')).toBeCloseTo(4.5, 3);
  const northern = stations.filter(({ position }) => position[1] > 4.5).map(({ id }) => id);
  expect((await shownStations()).filter((id) => stations.some((one) => one.id === id)).sort()).toEqual(northern.sort());
  expect(northern.length).toBeLessThan(stations.length);

  // What can't be is told, and nothing changes.
  await field('North').fill('far');
  await field('North').press('Enter');
  expect(await field('North').getAttribute('aria-invalid')).toBe('true');
  await field('North').press('Escape');
  await page.getByRole('button', { name: 'Whole building' }).click();
  await viewer.settle();
  expect(await page.getByLabel('Shown floor').inputValue()).toBe(floor.id);
  expect((await shownStations()).sort()).toEqual(stations.map(({ id }) => id).sort());
});

test('a finger drags the box', async () => {
  const fingers = await viewer.page.context().newCDPSession(viewer.page);
  await viewer.page.getByRole('button', { name: 'Box', exact: true }).click();
  await viewer.settle();
  const before = await placeOf('Top');
  const box = (await side('Top').boundingBox())!;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const touch = async (type: 'touchStart' | 'touchMove' | 'touchEnd', dy: number | null) => {
    const touchPoints = dy === null ? [] : [{ x, y: y + dy, id: 0 }];
    await fingers.send('Input.dispatchTouchEvent', { type, touchPoints });
    await viewer.settle();
  };
  await touch('touchStart', 0);
  for (const dy of [10, 20, 30]) await touch('touchMove', dy);
  await touch('touchEnd', null);
  expect(await placeOf('Top')).toBeLessThan(before - 0.2);
});

test('a line on the plan cuts the whole building upright, is looked at squarely and to scale, and turns round', async () => {
  const { page } = viewer;
  await page.getByRole('button', { name: 'Line on the plan' }).click();
  await viewer.settle();
  // From west to east between stations: to its left is what lies north.
  const places = await Promise.all(
    stations.map(async ({ id, position }) => {
      const box = (await page.locator(`.marker[data-station="${id}"]`).boundingBox())!;
      return { y: box.y + box.height / 2, sceneY: position[1] };
    }),
  );
  const [top, bottom] = [places.reduce((a, b) => (a.y < b.y ? a : b)), places.reduce((a, b) => (a.y > b.y ? a : b))];
  const cutY = 4.5;
  const y = top.y + ((cutY - top.sceneY) / (bottom.sceneY - top.sceneY)) * (bottom.y - top.y);
  await page.mouse.click(440, y);
  await page.mouse.click(1200, y);
  await viewer.settle();
  await viewer.screenshot('s-line');
  const cutIds = (isNorth: boolean) =>
    plan.stations.filter(({ position }) => position[1] > cutY === isNorth).map(({ id }) => id);
  expect(new Set(await shownStations())).toEqual(new Set(cutIds(true)));
  // Squarely and without perspective: stations of one height are on one level, however far off they are.
  const levels = await Promise.all(
    cutIds(true)
      .filter((id) => stations.some((one) => one.id === id))
      .map(async (id) => (await page.locator(`.marker[data-station="${id}"]`).boundingBox())!.y),
  );
  expect(Math.max(...levels) - Math.min(...levels)).toBeLessThan(60);
  expect(await page.getByTestId('plan-scale').count()).toBe(1);
  await page.getByRole('button', { name: 'Look the other way' }).click();
  await viewer.settle();
  expect(new Set(await shownStations())).toEqual(new Set(cutIds(false)));
  await page.getByText('Look at it squarely').click();
  await viewer.settle();
  await viewer.screenshot('s-line-beside');
  expect(await page.getByTestId('plan-scale').count()).toBe(0);
  await page.getByRole('button', { name: 'Whole building' }).click();
  await viewer.settle();
  expect((await shownStations()).sort()).toEqual(stations.map(({ id }) => id).sort());
});
