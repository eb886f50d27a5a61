/** The viewer in Firefox, where it is installed: the picture, a station's card, and a station dragged and kept. */
import { mkdirSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import type { Page } from 'puppeteer-core';
import { afterAll, beforeAll, expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { type Firefox, LACKS_FIREFOX, launchFirefox } from './firefox.ts';
import { PlanFiles } from './plan-files.ts';
import { type PlanServer, serveCopy } from './plan-server.ts';

const RESULTS = fileURLToPath(new URL('../test-results/', import.meta.url));
const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const [station] = plan.stations.filter((each) => each.floor === floor.id);
const markerOf = (id: string): string => `.marker[data-station="${id}"]`;

let firefox: Firefox;
let server: PlanServer;
beforeAll(async () => {
  if (LACKS_FIREFOX) return;
  server = await serveCopy(planFolder);
  firefox = await launchFirefox();
});
afterAll(async () => {
  await firefox?.close();
  await server?.stop();
});

/** A page at a view, and what goes wrong on it. */
async function open(hash: string): Promise<{ page: Page; faults: string[] }> {
  const page = await firefox.browser.newPage();
  page.setDefaultTimeout(240_000);
  const faults: string[] = [];
  page.on('pageerror', (error) => faults.push(`page error: ${error}`));
  page.on('console', (message) => {
    if (message.type() === 'error') faults.push(`console: ${message.text()}`);
  });
  await page.setViewport({ width: 1000, height: 680 });
  await page.goto(`${server.address}${hash}`);
  await page.waitForSelector('.marker:not([hidden])');
  await settle(page);
  return { page, faults };
}

function settle(page: Page): Promise<void> {
  return page.evaluate(
    () => new Promise<void>((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))),
  );
}

async function screenshot(page: Page, name: string): Promise<void> {
  mkdirSync(RESULTS, { recursive: true });
  await page.screenshot({ path: `${RESULTS}${name}.png` });
}

async function centreOf(page: Page, selector: string): Promise<{ x: number; y: number }> {
  const box = (await (await page.waitForSelector(selector))!.boundingBox())!;
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

/** Share of the picture, between its panels, that has another colour than the background. */
async function shareDrawn(page: Page): Promise<number> {
  const png = await page.screenshot({ encoding: 'base64', clip: { x: 350, y: 140, width: 640, height: 440 } });
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const paper = new OffscreenCanvas(image.width, image.height).getContext('2d')!;
    paper.drawImage(image, 0, 0);
    const { data } = paper.getImageData(0, 0, image.width, image.height);
    const corner = data.length - 4;
    let n = 0;
    for (let i = 0; i < data.length; i += 4) {
      if ([0, 1, 2].some((k) => Math.abs(data[i + k] - data[corner + k]) > 8)) n++;
    }
    return n / (data.length / 4);
  }, png);
}

test.skipIf(LACKS_FIREFOX)('Firefox shows the building, the figures, and a station with its cloud', async () => {
  const { page, faults } = await open('');
  const coverage = await page.$eval('[data-testid=coverage]', (figure) => figure.textContent);
  expect(coverage).toBe(`${(100 * plan.coverage.fraction_of_achievable).toFixed(1)} %`);
  expect((await page.$$('li [data-station]')).length).toBe(plan.stations.length);
  const drawn = await shareDrawn(page);
  expect(drawn).toBeGreaterThan(0.15);
  expect(drawn).toBeLessThan(0.95);
  await screenshot(page, 'firefox-1-building');
  await page.goto(`${server.address}#floor=${floor.id}&station=${station.id}`);
  await page.waitForSelector('[data-testid=cloud][data-state=shown]');
  await settle(page);
  await screenshot(page, 'firefox-2-station');
  expect(faults).toEqual([]);
  await page.close();
});

test.skipIf(LACKS_FIREFOX)('in Firefox a station is dragged, and the review keeps where to', async () => {
  const { page, faults } = await open(`#floor=${floor.id}&tab=edit`);
  await page.waitForSelector('[data-testid=totals]');
  await page.keyboard.press('t');
  await settle(page);
  const review = (): Promise<Review> => page.evaluate(async () => (await fetch('api/review')).json());
  const { revision } = await review();
  const { x, y } = await centreOf(page, markerOf(station.id));
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 6; i++) {
    await page.mouse.move(x + 10 * i, y + 6 * i);
    await settle(page);
  }
  await screenshot(page, 'firefox-3-dragged');
  await page.mouse.up();
  await expect.poll(async () => (await review()).revision).not.toBe(revision);
  const after = await centreOf(page, markerOf(station.id));
  expect(Math.hypot(after.x - x, after.y - y)).toBeGreaterThan(20);
  expect(faults).toEqual([]);
  await page.close();
});
