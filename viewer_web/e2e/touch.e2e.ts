/** Fingers, as on a tablet: the building pinched and turned, and both begun on a station's number. */
import { expect, inject, test } from 'vitest';
import { type PagePoint, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const stations = stationsOf(floor.id);
const [station] = stations;
const openPage = viewerPages({ width: 1024, height: 768, hasTouch: true });

test('two fingers pinch the building closer, on a number too, and no station moves', async () => {
  const viewer = await openPage();
  await viewer.openEditing(`floor=${floor.id}`);
  const { revision } = await viewer.review();
  const spacing = async (): Promise<number> => {
    const [a, b] = stations.slice(-2);
    const [from, to] = [await viewer.centreOf(a.id), await viewer.centreOf(b.id)];
    return Math.hypot(from[0] - to[0], from[1] - to[1]);
  };
  const box = (await viewer.page.locator('canvas').boundingBox())!;
  for (const [x, y] of [[box.x + box.width / 2, box.y + 60] as PagePoint, await viewer.centreOf(station.id)]) {
    const before = await spacing();
    await viewer.touch('touchStart', [x, y]);
    await viewer.touch('touchStart', [x, y], [x - 40, y + 30]);
    for (let i = 1; i <= 6; i++) {
      await viewer.touch('touchMove', [x + 6 * i, y - 4 * i], [x - 40 - 6 * i, y + 30 + 4 * i]);
    }
    await viewer.touch('touchEnd');
    await expect.poll(spacing).toBeGreaterThan(1.2 * before);
    await viewer.press('t');
  }
  expect((await viewer.review()).revision).toBe(revision);
});

test('where stations are not edited, a finger that begins on a number turns the building, and a tap chooses', async () => {
  const viewer = await openPage();
  await viewer.open(`#floor=${floor.id}`);
  await viewer.press('t');
  const [x, y] = await viewer.centreOf(station.id);
  const before = await viewer.hash();
  await viewer.touch('touchStart', [x, y]);
  for (let i = 1; i <= 6; i++) await viewer.touch('touchMove', [x + 10 * i, y]);
  await viewer.touch('touchEnd');
  await expect.poll(() => viewer.hash()).not.toBe(before);
  await expect.poll(() => viewer.hash()).not.toContain('station=');
  await viewer.press('t');
  await viewer.marker(station.id).tap();
  await expect.poll(() => viewer.hash()).toContain(`station=${station.id}`);
});
