/** Editing with fingers, as on a tablet: stations dragged, the building pinched, and both begun on a station's number. */
import type { CDPSession, Locator } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const [station] = plan.stations.filter(({ floor: id }) => id === floor.id);

type Place = readonly [number, number];

const own = ownCopy(planFolder);
let viewer: ViewerPage;
let fingers: CDPSession;
beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 1024, height: 768, hasTouch: true });
  fingers = await viewer.page.context().newCDPSession(viewer.page);
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

async function open(tab: string): Promise<void> {
  await viewer.open(`#floor=${floor.id}&tab=${tab}`);
  if (tab === 'edit') {
    // First that there is a server, then that it is ready.
    await viewer.page.getByRole('radiogroup', { name: 'Tool' }).waitFor();
    await viewer.page.getByTestId('live-note').waitFor({ state: 'detached' });
    await viewer.page.getByTestId('totals').waitFor();
  }
  await viewer.page.keyboard.press('t');
  await viewer.settle();
}

const marker = (id: string): Locator => viewer.page.locator(`.marker[data-station="${id}"]`);

async function centreOf(id: string): Promise<Place> {
  const box = (await marker(id).boundingBox())!;
  return [box.x + box.width / 2, box.y + box.height / 2];
}

async function review(): Promise<Review> {
  return viewer.page.evaluate(async () => (await fetch('api/review')).json());
}

async function touch(type: 'touchStart' | 'touchMove' | 'touchEnd', places: readonly Place[]): Promise<void> {
  await fingers.send('Input.dispatchTouchEvent', { type, touchPoints: places.map(([x, y], id) => ({ x, y, id })) });
  await viewer.settle();
}

/** Metres on the screen: how far two stations' numbers are apart. */
async function spacing(): Promise<number> {
  const [a, b] = plan.stations.filter(({ floor: id }) => id === floor.id).slice(-2);
  const [from, to] = [await centreOf(a.id), await centreOf(b.id)];
  return Math.hypot(from[0] - to[0], from[1] - to[1]);
}

test('a finger drags a station to another place', { tags: 'main' }, async () => {
  await open('edit');
  const { revision } = await review();
  const [x, y] = await centreOf(station.id);
  await touch('touchStart', [[x, y]]);
  for (let i = 1; i <= 10; i++) await touch('touchMove', [[x + 7 * i, y + 4 * i]]);
  await viewer.screenshot('touch-1-dragging');
  await touch('touchEnd', []);
  await expect.poll(async () => (await review()).revision).toBeGreaterThan(revision);
  expect((await review()).stations[station.id].position_m).not.toEqual(station.position);
  await viewer.settle();
  const moved = await centreOf(station.id);
  expect(Math.hypot(moved[0] - x, moved[1] - y)).toBeGreaterThan(15);
  await viewer.page.getByRole('button', { name: `Undo: move ${station.id}` }).tap();
  await expect.poll(async () => Object.keys((await review()).stations)).toEqual([]);
});

test('two fingers pinch the building closer, on a number too, and no station moves', async () => {
  await open('edit');
  const { revision } = await review();
  const box = (await viewer.page.locator('canvas').boundingBox())!;
  for (const start of [[box.x + box.width / 2, box.y + 60] as Place, await centreOf(station.id)]) {
    const before = await spacing();
    const [x, y] = start;
    await touch('touchStart', [[x, y]]);
    const second: Place = [x - 40, y + 30];
    await touch('touchStart', [[x, y], second]);
    for (let i = 1; i <= 6; i++) {
      await touch('touchMove', [
        [x + 6 * i, y - 4 * i],
        [second[0] - 6 * i, second[1] + 4 * i],
      ]);
    }
    await touch('touchEnd', []);
    expect(await spacing()).toBeGreaterThan(1.2 * before);
    await viewer.page.keyboard.press('t');
    await viewer.settle();
  }
  expect((await review()).revision).toBe(revision);
});

test('where stations are not edited, a finger that begins on a number turns the building, and a tap chooses', async () => {
  await open('plan');
  const [x, y] = await centreOf(station.id);
  const before = await viewer.hash();
  await touch('touchStart', [[x, y]]);
  for (let i = 1; i <= 6; i++) await touch('touchMove', [[x + 10 * i, y]]);
  await touch('touchEnd', []);
  await expect.poll(() => viewer.hash()).not.toBe(before);
  expect(await viewer.hash()).not.toContain('station=');
  await viewer.page.keyboard.press('t');
  await viewer.settle();
  await marker(station.id).tap();
  await expect.poll(() => viewer.hash()).toContain(`station=${station.id}`);
});
