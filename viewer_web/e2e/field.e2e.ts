/** The field view in a real browser: the next station, the way there, ticks that stay on the device, no network. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, test, vi } from 'vitest';
import { walkOf } from '../src/field/walk.ts';
import { type PlanJson, parsePlan } from '../src/load/plan-json.ts';
import { launchBrowser, ViewerPage } from './browser.ts';

vi.setConfig({ testTimeout: 180_000, hookTimeout: 180_000 });

const address = inject('address');
const plan: PlanJson = parsePlan(JSON.parse(readFileSync(join(inject('planFolder'), 'plan.json'), 'utf8')));
const stops = walkOf(plan);

let browser: Browser;
let viewer: ViewerPage;
beforeAll(async () => {
  browser = await launchBrowser();
});
afterAll(() => browser.close());
beforeEach(async () => {
  // A tablet, held upright.
  viewer = await ViewerPage.create(browser, address, { width: 768, height: 1024, hasTouch: true });
  await viewer.page.goto(`${address}#view=field`);
  await viewer.page.getByTestId('field-count').waitFor({ timeout: 120_000 });
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

const text = (id: string): Promise<string | null> => viewer.page.getByTestId(id).textContent();

test('the next station, its number and the way there are shown, station after station', async () => {
  expect(plan.route).not.toBeNull();
  await viewer.screenshot('field-1-begin');
  for (const [i, stop] of stops.slice(0, 3).entries()) {
    expect(await text('field-number')).toBe(String(stop.order));
    expect(await text('field-station')).toBe(stop.stationId);
    if (i > 0 && stop.wayM !== null && stop.wayM > 0) expect(await text('field-way')).toMatch(/^\d+(\.\d)? m to go$/);
    await viewer.page.getByRole('button', { name: 'Done', exact: true }).tap();
    expect(await text('field-count')).toBe(`${i + 1} of ${stops.length}`);
  }
  await viewer.screenshot('field-2-under-way');
});

test('ticks stay on the device, work without a network, and can be taken back', async () => {
  await viewer.page.getByRole('button', { name: 'Done', exact: true }).tap();
  await viewer.page.reload();
  await viewer.page.getByTestId('field-count').waitFor({ timeout: 120_000 });
  expect(await text('field-count')).toBe(`1 of ${stops.length}`);
  await viewer.page.context().setOffline(true);
  await viewer.page.getByRole('button', { name: 'Done', exact: true }).tap();
  expect(await text('field-station')).toBe(stops[2].stationId);
  await viewer.page.getByRole('checkbox', { name: `${stops[0].stationId} done` }).uncheck();
  expect(await text('field-station')).toBe(stops[0].stationId);
  expect(await text('field-count')).toBe(`1 of ${stops.length}`);
  await viewer.page.context().setOffline(false);
  // The page notes that events could not be had meanwhile.
  viewer.faults.splice(0);
});

test('any station can be looked up, and the whole plan is a tap away', async () => {
  const last = stops[stops.length - 1];
  await viewer.page
    .getByRole('button', { name: new RegExp(`^\\S*\\s*${last.stationId}`) })
    .last()
    .tap();
  expect(await text('field-station')).toBe(last.stationId);
  await viewer.page.getByRole('button', { name: 'The whole plan' }).tap();
  await viewer.page.locator('.marker').first().waitFor({ state: 'attached', timeout: 120_000 });
  expect(new URL(viewer.page.url()).hash).not.toContain('view=field');
});

test('stations at one spot are one dot with their number, and a tap lists them', async () => {
  const [first, second] = stops.filter(({ floorId }) => floorId === stops[0].floorId);
  const atOneSpot = plan.stations.map((station) =>
    station.id === second.stationId
      ? { ...station, position: [first.positionM[0], first.positionM[1], first.positionM[2] + 0.4] }
      : station,
  );
  const { page } = viewer;
  await page.route('**/plan/plan.json', async (route) => {
    const body = await (await route.fetch()).json();
    await route.fulfill({ json: { ...body, stations: atOneSpot } });
  });
  await page.reload();
  await page.getByTestId('field-count').waitFor({ timeout: 120_000 });
  const map = page.getByRole('group', { name: 'Map of the floor' });
  const stack = map.getByRole('button', { name: /^\d stations here: / });
  expect(await stack.first().getAttribute('aria-label')).toContain(`${first.stationId}; ${second.stationId}`);
  await stack.first().tap();
  const list = page.getByRole('region', { name: 'Stations at this spot' });
  await viewer.screenshot('field-3-one-spot');
  await list.getByRole('button', { name: new RegExp(second.stationId) }).tap();
  expect(await list.count()).toBe(0);
  expect(await text('field-station')).toBe(second.stationId);
});
