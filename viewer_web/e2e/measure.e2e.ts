/** Measuring in a real browser: distances in metres and feet, site coordinates; by mouse, finger and keys. */
import { expect, inject, test } from 'vitest';
import { type Look, type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles, siteOf, withSite } from './plan-files.ts';

const { ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const stations = stationsOf(floor.id);

const openPage = viewerPages({ width: 1280, height: 800 });
let viewer: ViewerPage;

async function openPlan(look: Look = {}): Promise<void> {
  viewer = await openPage(look);
  await viewer.open(`#floor=${floor.id}`);
  await viewer.page.keyboard.press('p');
  await viewer.page.getByTestId('plan-scale').waitFor();
  await viewer.settle();
}

const measure = () => viewer.page.getByRole('button', { name: 'Measure', exact: true }).click();
const results = () => viewer.page.getByTestId('measurement');
const lengthIn = (text: string | null): number => Number(/([\d.]+) m/.exec(text ?? '')?.[1]);

test('a distance between stations is that of plan.json, in metres and in feet, and goes with its remove button', async () => {
  await openPlan();
  const { page } = viewer;
  await measure();
  const [a, b] = [stations[0], stations.at(-1)!];
  for (const { id } of [a, b]) await page.locator(`.marker[data-station="${id}"]`).click();
  await results().first().waitFor();
  const [dx, dy, dz] = a.position.map((x, k) => x - b.position[k]);
  expect(lengthIn(await results().textContent())).toBeCloseTo(Math.hypot(dx, dy), 3);
  await expect.poll(() => results().textContent()).toContain('Distance in plan');
  const rest = await results().locator('dd').allTextContents();
  expect(lengthIn(rest[0])).toBeCloseTo(Math.hypot(dx, dy, dz), 3);
  // A station was measured to, not chosen.
  await expect.poll(() => page.getByRole('heading', { name: /^Station S/ }).count()).toBe(0);
  await results().getByRole('button', { name: 'Points' }).click();
  await expect.poll(() => results().textContent()).toContain(a.position.map((x) => x.toFixed(2)).join(', '));
  await page.getByRole('button', { name: 'Feet' }).click();
  const [, feet, inches] = /(\d+)' (\d+)/.exec((await results().locator('strong').textContent())!)!;
  expect(Number(feet) + Number(inches) / 12).toBeCloseTo(Math.hypot(dx, dy) / 0.3048, 0);
  await viewer.screenshot('m-distance');
  await page.getByRole('button', { name: 'Feet' }).click();
  await page.getByRole('button', { name: /^Remove distance/ }).click();
  await expect.poll(() => results().count()).toBe(0);
});

test('where the scene has a map conversion, points have site coordinates, and the arrow points to grid north', async () => {
  viewer = await openPage();
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
    await expect.poll(() => results().textContent()).toContain(`E ${e}, N ${n}, H ${h}`);
  }
  await page.keyboard.press('Escape');
  await page.keyboard.press('Escape');
  const [x, y] = await viewer.centreOf(a.id);
  await page.mouse.click(x + 30, y + 40);
  const { Position: scene, Site: site } = await viewer.figures('surface-figures');
  const shown = (site.match(/[\d.]+/g) ?? []).map(Number);
  const expected = siteOf(scene.split(', ').map(Number));
  // Scene coordinates are shown to the centimetre.
  expect(shown.map((value, k) => Math.abs(value - expected[k]) < 0.011)).toEqual([true, true, true]);
  await viewer.screenshot('m-site');
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
  const shown = lengthIn(await results().first().locator('strong').textContent());
  // Ends may have snapped to what is near to them.
  expect(Math.abs(shown * perMetre - Math.hypot(120, 3))).toBeLessThan(25);
  // The floor below was not opened meanwhile, nor another station chosen.
  await expect.poll(() => page.getByLabel('Shown floor').inputValue()).toBe(floor.id);
  await page.keyboard.press('Enter');
  await page.keyboard.press('Escape');
  await expect.poll(() => page.locator('.measure-crosshair').count()).toBe(1);
  await page.keyboard.press('Escape');
  await expect.poll(() => page.locator('.measure-crosshair').count()).toBe(0);
  await expect.poll(() => page.evaluate(() => document.activeElement?.id)).toBe('site-tool-measure');
  await page.keyboard.press('Escape');
  await expect.poll(() => page.getByRole('region', { name: 'Measure' }).count()).toBe(0);
  // The result stays on the picture, and in the panel when it opens again.
  await expect.poll(() => page.locator('.measured polyline').count()).toBeGreaterThan(0);
});

test('a finger measures with taps, and drags shift the plan', async () => {
  await openPlan({ width: 1024, height: 768, hasTouch: true });
  const { page } = viewer;
  await page.getByRole('button', { name: 'Measure', exact: true }).tap();
  await page.getByRole('button', { name: 'Height', exact: true }).tap();
  const place = await viewer.planToPage(stations);
  const [low, high] = [stations[0], stations[1]];
  for (const { position } of [low, high]) {
    const [x, y] = place(position[0], position[1]);
    await page.touchscreen.tap(x, y + 22);
  }
  await results().first().waitFor();
  await expect.poll(() => results().first().textContent()).toContain('Height');
  const apartM = Math.hypot(low.position[0] - high.position[0], low.position[1] - high.position[1]);
  expect(lengthIn(await results().first().locator('dd').first().textContent())).toBeCloseTo(apartM, 0.9);
  await expect.poll(() => page.getByRole('heading', { name: /^Station S/ }).count()).toBe(0);
  await viewer.screenshot('m-touch');
});
