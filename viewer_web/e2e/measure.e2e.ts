/** Measuring on site in a real browser: the plan view to scale, points that snap, distances to walls; by mouse, finger and keys. */
import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, expect, inject, test } from 'vitest';
import { type Look, launchBrowser, ViewerPage } from './browser.ts';
import { PlanFiles, siteOf, withSite } from './plan-files.ts';

const address = inject('address');
const { plan } = new PlanFiles(inject('planFolder'));
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const stations = plan.stations.filter((station) => station.floor === floor.id);
const positionOf = (id: string) => plan.stations.find((station) => station.id === id)!.position;

let browser: Browser;
let viewer: ViewerPage;
beforeAll(async () => {
  browser = await launchBrowser();
});
afterAll(() => browser.close());
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

async function openPlan(look: Look = {}): Promise<void> {
  viewer = await ViewerPage.create(browser, address, { width: 1280, height: 800, ...look });
  await viewer.open(`#floor=${floor.id}`);
  await viewer.page.keyboard.press('p');
  await viewer.page.getByTestId('plan-scale').waitFor();
  await viewer.settle();
}

async function centreOf(id: string): Promise<[number, number]> {
  const box = (await viewer.page.locator(`.marker[data-station="${id}"]`).boundingBox())!;
  return [box.x + box.width / 2, box.y + box.height / 2];
}

/** Where scene coordinates are on the page: by where the numbers of two stations far apart are, which the plan view did not draw. */
async function scale(): Promise<(x: number, y: number) => [number, number]> {
  const from = stations.reduce((a, b) => (a.position[0] + a.position[1] < b.position[0] + b.position[1] ? a : b));
  const to = stations.reduce((a, b) => (a.position[0] + a.position[1] > b.position[0] + b.position[1] ? a : b));
  const [[ax, ay], [bx, by]] = [await centreOf(from.id), await centreOf(to.id)];
  const perX = (bx - ax) / (to.position[0] - from.position[0]);
  const perY = (by - ay) / (to.position[1] - from.position[1]);
  return (x, y) => [ax + perX * (x - from.position[0]), ay + perY * (y - from.position[1])];
}

const measure = () => viewer.page.getByRole('button', { name: 'Measure', exact: true }).click();
const kind = (name: string) => viewer.page.getByRole('button', { name, exact: true }).click();
const results = () => viewer.page.getByTestId('measurement');
const lengthIn = (text: string | null): number => Number(/([\d.]+) m/.exec(text ?? '')?.[1]);

test('the plan view is to scale everywhere, with a grid, a scale bar and north, and leaves again', {
  tags: 'main',
}, async () => {
  await openPlan();
  const { page } = viewer;
  const pixels: number[] = [];
  for (const a of stations) {
    for (const b of stations) {
      const m = Math.hypot(a.position[0] - b.position[0], a.position[1] - b.position[1]);
      if (a.id >= b.id || m < 2) continue;
      const [[ax, ay], [bx, by]] = [await centreOf(a.id), await centreOf(b.id)];
      pixels.push(Math.hypot(ax - bx, ay - by) / m);
    }
  }
  expect(pixels.length).toBeGreaterThan(20);
  // Numbers are on whole pixels; with perspective those of higher and lower stations would differ by more.
  for (const one of pixels) expect(one / pixels[0]).toBeCloseTo(1, 1.9);
  const words = page.getByTestId('scale-words');
  const bar = Number(await words.getAttribute('data-pixels'));
  expect(bar / lengthIn(await words.textContent()) / pixels[0]).toBeCloseTo(1, 1.9);
  expect(await page.getByTestId('plan-grid').locator('line').count()).toBeGreaterThan(5);
  expect(await page.getByTestId('plan-scale').textContent()).toContain('north');
  expect(await viewer.hash()).toContain('flat');
  await viewer.screenshot('m-plan');
  // Round steps stay while one comes closer, and a drag shifts the plan instead of turning it.
  const [x, y] = await centreOf(stations[0].id);
  await page.mouse.move(900, 640);
  await page.mouse.down();
  await page.mouse.move(930, 620, { steps: 4 });
  await page.mouse.up();
  await viewer.settle();
  const [movedX, movedY] = await centreOf(stations[0].id);
  expect([movedX - x, movedY - y]).toEqual([expect.closeTo(30, -0.5), expect.closeTo(-20, -0.5)]);
  await page.getByRole('button', { name: 'Plan view' }).click();
  await viewer.settle();
  expect(await page.getByTestId('plan-scale').count()).toBe(0);
  expect(await viewer.hash()).not.toContain('flat');
});

test('a distance between stations is that of plan.json, in metres and in feet, and goes with its remove button', async () => {
  await openPlan();
  const { page } = viewer;
  await measure();
  const [a, b] = [stations[0], stations.at(-1)!];
  for (const { id } of [a, b]) await page.locator(`.marker[data-station="${id}"]`).click();
  await results().first().waitFor();
  const [dx, dy, dz] = a.position.map((x, k) => x - b.position[k]);
  expect(lengthIn(await results().textContent())).toBeCloseTo(Math.hypot(dx, dy), 3);
  expect(await results().textContent()).toContain('Distance in plan');
  const rest = await results().locator('dd').allTextContents();
  expect(lengthIn(rest[0])).toBeCloseTo(Math.hypot(dx, dy, dz), 3);
  // A station was measured to, not chosen.
  expect(await page.getByRole('heading', { name: /^Station S/ }).count()).toBe(0);
  await results().getByRole('button', { name: 'Points' }).click();
  expect(await results().textContent()).toContain(a.position.map((x) => x.toFixed(2)).join(', '));
  await page.getByRole('button', { name: 'Feet' }).click();
  const [, feet, inches] = /(\d+)' (\d+)/.exec((await results().locator('strong').textContent())!)!;
  expect(Number(feet) + Number(inches) / 12).toBeCloseTo(Math.hypot(dx, dy) / 0.3048, 0);
  await viewer.screenshot('m-distance');
  await page.getByRole('button', { name: 'Feet' }).click();
  await page.getByRole('button', { name: /^Remove distance/ }).click();
  expect(await results().count()).toBe(0);
});

test('where the scene has a map conversion, points have site coordinates, and the arrow points to grid north', async () => {
  viewer = await ViewerPage.create(browser, address, { width: 1280, height: 800 });
  const { page } = viewer;
  await page.route('**/plan/plan.json', (route) => route.fulfill({ json: withSite(inject('planFolder')) }));
  await viewer.open(`#floor=${floor.id}&show=flat`);
  await page.getByRole('img', { name: 'Grid north, 30° clockwise from up' }).waitFor();
  await measure();
  const [a, b] = [stations[0], stations[1]];
  for (const { id } of [a, b]) await page.locator(`.marker[data-station="${id}"]`).click();
  await results().getByRole('button', { name: 'Points' }).click();
  for (const { position } of [a, b]) {
    const [e, n, h] = siteOf(position).map((value) => value.toFixed(3));
    expect(await results().textContent()).toContain(`E ${e}, N ${n}, H ${h}`);
  }
  await page.keyboard.press('Escape');
  await page.keyboard.press('Escape');
  const [x, y] = await centreOf(a.id);
  await page.mouse.click(x + 30, y + 40);
  const { Position: scene, Site: site } = await viewer.figures('surface-figures');
  const told = (site.match(/[\d.]+/g) ?? []).map(Number);
  const expected = siteOf(scene.split(', ').map(Number));
  // Scene coordinates are told to the centimetre.
  expect(told.map((value, k) => Math.abs(value - expected[k]) < 0.011)).toEqual([true, true, true]);
  await viewer.screenshot('m-site');
});

/** Of the house: its outer walls are a rectangle of 10 x 8 m from the origin. */
const HOUSE = [
  [0, 0],
  [10, 0],
  [10, 8],
  [0, 8],
] as const;

test('corners of walls snap: the house measures 10 x 8 m and 80 m² though no click is exact', {
  tags: 'main',
}, async () => {
  await openPlan();
  const { page } = viewer;
  await measure();
  // The panel lies over a corner: a drag brings the house out from under it.
  await page.mouse.move(900, 640);
  await page.mouse.down();
  await page.mouse.move(1000, 700, { steps: 5 });
  await page.mouse.up();
  for (let i = 0; i < 3; i++) await page.keyboard.press('-');
  await viewer.settle();
  const place = await scale();
  const near = (i: number): [number, number] => {
    const [x, y] = place(HOUSE[i][0], HOUSE[i][1]);
    return [x + (i % 2 === 0 ? 4 : -5), y + (i < 2 ? -4 : 3)];
  };
  await page.mouse.move(...near(1));
  await viewer.settle();
  expect(await page.locator('.measure-mark').getAttribute('data-on')).toBe('corner');
  for (const i of [1, 2]) await page.mouse.click(...near(i));
  expect(lengthIn(await results().first().locator('strong').textContent())).toBeCloseTo(8, 3);
  await kind('Area');
  for (const i of [0, 1, 2, 3, 0]) await page.mouse.click(...near(i));
  await expect.poll(() => results().count()).toBe(2);
  expect(await results().first().locator('strong').textContent()).toBe('80.00 m²');
  expect(lengthIn(await results().first().locator('dd').first().textContent())).toBeCloseTo(36, 2);
  await kind('Angle');
  for (const i of [0, 1, 2]) await page.mouse.click(...near(i));
  await expect.poll(() => results().count()).toBe(3);
  expect(await results().first().locator('strong').textContent()).toBe('90.00°');
  await viewer.screenshot('m-corners');
});

test('keys alone measure: arrows move a crosshair, Enter takes points, Escape leaves step by step', async () => {
  await openPlan();
  const { page } = viewer;
  await page.keyboard.press('m');
  await page.keyboard.press('ArrowRight');
  await viewer.settle();
  await page.locator('.measure-crosshair').waitFor({ state: 'attached' });
  await page.keyboard.press('Enter');
  for (let i = 0; i < 12; i++) await page.keyboard.press('ArrowRight');
  for (let i = 0; i < 3; i++) await page.keyboard.press('Shift+ArrowDown');
  await page.keyboard.press('Enter');
  await results().first().waitFor();
  const words = page.getByTestId('scale-words');
  const perMetre = Number(await words.getAttribute('data-pixels')) / lengthIn(await words.textContent());
  const told = lengthIn(await results().first().locator('strong').textContent());
  // Ends may have snapped to what is near to them.
  expect(Math.abs(told * perMetre - Math.hypot(120, 3))).toBeLessThan(25);
  // The floor below was not opened meanwhile, nor another station chosen.
  expect(await page.getByLabel('Shown floor').inputValue()).toBe(floor.id);
  await page.keyboard.press('Enter');
  await page.keyboard.press('Escape');
  expect(await page.locator('.measure-crosshair').count()).toBe(1);
  await page.keyboard.press('Escape');
  expect(await page.locator('.measure-crosshair').count()).toBe(0);
  expect(await page.evaluate(() => document.activeElement?.id)).toBe('site-tool-measure');
  await page.keyboard.press('Escape');
  expect(await page.getByRole('region', { name: 'Measure' }).count()).toBe(0);
  // The result stays on the picture, and in the panel when it opens again.
  expect(await page.locator('.measured polyline').count()).toBeGreaterThan(0);
});

test('a finger measures with taps, and drags shift the plan', async () => {
  await openPlan({ width: 1024, height: 768, hasTouch: true });
  const { page } = viewer;
  await page.getByRole('button', { name: 'Measure', exact: true }).tap();
  await page.getByRole('button', { name: 'Height', exact: true }).tap();
  const place = await scale();
  const [low, high] = [stations[0], stations[1]];
  for (const { position } of [low, high]) {
    const [x, y] = place(position[0], position[1]);
    await page.touchscreen.tap(x, y + 22);
  }
  await results().first().waitFor();
  expect(await results().first().textContent()).toContain('Height');
  const apartM = Math.hypot(low.position[0] - high.position[0], low.position[1] - high.position[1]);
  expect(lengthIn(await results().first().locator('dd').first().textContent())).toBeCloseTo(apartM, 0.9);
  expect(await page.getByRole('heading', { name: /^Station S/ }).count()).toBe(0);
  await viewer.screenshot('m-touch');
});

test('a station tells how far it is square to the walls around it', { tags: 'main' }, async () => {
  await openPlan();
  const { page } = viewer;
  /** Inner faces of the walls of the living room, and of the one beside it, as scenes_synthetic builds them. */
  const [south, north, spine] = [0.3, 7.7, 5.2];
  const station = stations.find(({ position: [x, y] }) => x > 5.5 && x < 7 && y > 2 && y < 4)!;
  const [x, y] = positionOf(station.id);
  await page.locator(`.marker[data-station="${station.id}"]`).click();
  await page.getByText('Distances to walls').click();
  const told = await page.getByTestId('set-up-distances').locator('dd').allTextContents();
  const expected = [x - spine, y - south, north - y].sort((a, b) => a - b);
  expect(
    told
      .map(lengthIn)
      .slice(0, 3)
      .sort((a, b) => a - b),
  ).toEqual(expected.map((m) => expect.closeTo(m, 2)));
  expect(await page.locator('.set-up polyline').count()).toBe(2 * told.length);
  await viewer.screenshot('m-set-up');
  await page.getByText('Distances to walls').click();
  expect(await page.locator('.set-up polyline').count()).toBe(0);
});
