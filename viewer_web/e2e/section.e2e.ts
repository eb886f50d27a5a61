/** Sections in a real browser: a box dragged by a finger, and a vertical section along a line on the plan. */
import { expect, inject, test } from 'vitest';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const stations = stationsOf(floor.id);
const openPage = viewerPages({ width: 1280, height: 800 });

test('a line on the plan cuts the building upright, seen squarely and to scale, from both sides; a finger drags a box', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open(`#floor=${floor.id}`);
  await page.getByRole('button', { name: 'Section', exact: true }).click();
  await page.getByRole('button', { name: 'Line on the plan' }).click();
  await viewer.settle();
  // From west to east between stations: to its left is what lies north.
  const cutY = 4.75;
  const [, y] = (await viewer.planToPage(stations))(0, cutY);
  await page.mouse.click(440, y);
  await page.mouse.click(1200, y);
  await viewer.settle();
  await viewer.screenshot('section-line');
  const cutIds = (isNorth: boolean) =>
    plan.stations.filter(({ position }) => position[1] > cutY === isNorth).map(({ id }) => id);
  await expect.poll(() => viewer.shownStations()).toEqual(cutIds(true).sort());
  // Squarely and without perspective: stations of one height are on one level, however far off they are.
  const northern = cutIds(true).filter((id) => stations.some((one) => one.id === id));
  const levels = await Promise.all(northern.map(async (id) => (await viewer.centreOf(id))[1]));
  expect(Math.max(...levels) - Math.min(...levels)).toBeLessThan(60);
  await expect.poll(() => page.getByTestId('plan-scale').count()).toBe(1);
  await page.getByRole('button', { name: 'Look the other way' }).click();
  await viewer.settle();
  await expect.poll(() => viewer.shownStations()).toEqual(cutIds(false).sort());
  await page.getByText('Look at it squarely').click();
  await viewer.settle();
  await expect.poll(() => page.getByTestId('plan-scale').count()).toBe(0);
  await page.getByRole('button', { name: 'Whole building' }).click();
  await viewer.settle();
  await expect.poll(() => viewer.shownStations()).toEqual(stations.map(({ id }) => id).sort());

  await page.getByRole('button', { name: 'Box', exact: true }).click();
  await viewer.settle();
  const top = page.getByRole('slider', { name: 'Top side of the section box' });
  const topM = async (): Promise<number> => Number(await top.getAttribute('aria-valuenow'));
  const before = await topM();
  const box = (await top.boundingBox())!;
  const at = (dy: number): [number, number] => [box.x + box.width / 2, box.y + box.height / 2 + dy];
  await viewer.touch('touchStart', at(0));
  for (const dy of [10, 20, 30]) await viewer.touch('touchMove', at(dy));
  await viewer.touch('touchEnd');
  await expect.poll(topM).toBeLessThan(before - 0.2);
});
