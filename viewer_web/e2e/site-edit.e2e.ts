/** Stations at coordinates, in a real browser: at a clicked surface, and typed as site coordinates. */
import { beforeEach, expect, inject, test } from 'vitest';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles, siteOf, withSite } from './plan-files.ts';

const planFolder = inject('planFolder');
const { ground: floor, stationsOf } = new PlanFiles(planFolder);
const stations = stationsOf(floor.id);

const openPage = viewerPages({ width: 1280, height: 800 });
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await openPage();
});

test('a station is added at the clicked surface, and is among those that see it', async () => {
  const { page } = viewer;
  await viewer.open(`#floor=${floor.id}&show=flat`);
  await page.getByTestId('plan-scale').waitFor();
  const [x, y] = await viewer.centreOf(stations[0].id);
  await page.mouse.click(x + 17, y + 47);
  const figures = await viewer.figures('surface-figures');
  const at = figures.Position.split(', ').map(Number);
  const button = page.getByRole('button', { name: 'Add a station here' });
  await expect.poll(() => button.isEnabled()).toBe(true);
  await button.click();
  await expect
    .poll(async () => Object.values((await viewer.review()).stations).filter(({ added }) => added).length)
    .toBe(1);
  const [added] = Object.values((await viewer.review()).stations);
  expect(Math.hypot(added.position_m![0] - at[0], added.position_m![1] - at[1])).toBeLessThan(0.7);
  const [id] = Object.keys((await viewer.review()).stations);
  // Not under the tripod, where the scanner sees nothing: around it.
  await viewer.marker(id).waitFor();
  const [atX, atY] = await viewer.centreOf(id);
  const seenAt: string[][] = [];
  for (const [dx, dy] of [
    [-110, 40],
    [-90, -60],
    [20, 120],
    [-150, 90],
  ]) {
    await page.mouse.click(atX + dx, atY + dy);
    await page.locator('.card').getByText('Asking which stations see it').waitFor({ state: 'detached' });
    const rows = page.getByRole('list', { name: 'Stations that see it' }).locator('li span:first-child');
    seenAt.push(await rows.allTextContents());
  }
  expect(
    seenAt.some((ids) => ids.includes(id)),
    JSON.stringify(seenAt),
  ).toBe(true);
  await viewer.undo();
});

test('a station goes to a typed easting, and its scene coordinates follow the map conversion', async () => {
  const { page } = viewer;
  await page.route('**/plan/plan.json', (route) => route.fulfill({ json: withSite(planFolder) }));
  await viewer.openEditing(`floor=${floor.id}`, 'p');
  const [{ id, position }] = stations;
  await viewer.marker(id).click();
  await page.getByRole('radio', { name: 'Site', exact: true }).click();
  const easting = page.getByLabel('Easting, m', { exact: true });
  const [e, n] = siteOf(position);
  await expect.poll(() => easting.inputValue()).toBe(e.toFixed(3));
  await easting.fill((e + 0.2).toFixed(3));
  await easting.press('Enter');
  await expect.poll(async () => (await viewer.review()).stations[id]?.position_m ?? null).not.toBeNull();
  const [movedE, movedN] = siteOf((await viewer.review()).stations[id].position_m!);
  expect([movedE - e, movedN - n]).toEqual([expect.closeTo(0.2, 2), expect.closeTo(0, 2)]);
  await viewer.undo();
});

test('what is typed before the page has drawn anew counts', async () => {
  const { page } = viewer;
  await page.route('**/plan/plan.json', (route) => route.fulfill({ json: withSite(planFolder) }));
  await viewer.openEditing(`floor=${floor.id}`, 'p');
  const [{ id, position }] = stations;
  await viewer.marker(id).click();
  await page.getByRole('radio', { name: 'Site', exact: true }).waitFor();
  // As on a slow machine: choosing, typing and Enter all come before the next frame.
  await page.evaluate(
    async ({ easting }) => {
      const rendered = async (): Promise<void> => {
        for (let i = 0; i < 20; i++) await Promise.resolve();
      };
      const radios = [...document.querySelectorAll<HTMLElement>('.station-coordinates [role=radio]')];
      radios.find(({ textContent }) => textContent === 'Site')!.click();
      await rendered();
      const field = document.querySelector<HTMLInputElement>('[aria-label="Easting, m"]')!;
      field.value = easting;
      field.dispatchEvent(new InputEvent('input', { bubbles: true }));
      await rendered();
      field.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', bubbles: true }));
    },
    { easting: (siteOf(position)[0] + 0.2).toFixed(3) },
  );
  await expect.poll(async () => (await viewer.review()).stations[id]?.position_m ?? null).not.toBeNull();
  const [movedE] = siteOf((await viewer.review()).stations[id].position_m!);
  expect(movedE - siteOf(position)[0]).toBeCloseTo(0.2, 2);
  await viewer.undo();
});
