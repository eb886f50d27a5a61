/** From a surface or from coordinates to stations, in a real browser: who sees what was clicked, stations there, typed, and several at once. */
import type { Locator } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles, siteOf, withSite } from './plan-files.ts';

const planFolder = inject('planFolder');
const files = new PlanFiles(planFolder);
const { plan } = files;
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const stations = plan.stations.filter((station) => station.floor === floor.id);

const own = ownCopy(planFolder);
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 1280, height: 800 });
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

async function open(hash: string): Promise<void> {
  await viewer.open(`#floor=${floor.id}&${hash}`);
  await viewer.page.keyboard.press('p');
  await viewer.page.getByTestId('plan-scale').waitFor();
  await viewer.settle();
}

async function openEditing(): Promise<void> {
  await open('tab=edit');
  await viewer.page.getByRole('radiogroup', { name: 'Tool' }).waitFor();
  await viewer.page.getByTestId('live-note').waitFor({ state: 'detached' });
  await viewer.page.getByTestId('totals').waitFor();
}

const review = (): Promise<Review> =>
  viewer.page.evaluate(async () => (await fetch('api/review')).json()) as Promise<Review>;
const marker = (id: string): Locator => viewer.page.locator(`.marker[data-station="${id}"]`);
const sights = () => viewer.page.getByRole('list', { name: 'Stations that see it' }).locator('li');

/** Station, range, incidence, and "best" where it is. */
const sightRows = (): Promise<string[][]> =>
  sights().evaluateAll((all) =>
    all.map((row) => [...row.querySelectorAll('span')].map((part) => part.textContent ?? '')),
  );

async function undo(): Promise<void> {
  const { revision } = await review();
  await viewer.page.getByRole('button', { name: /^Undo: / }).click();
  await expect.poll(async () => (await review()).revision).toBeGreaterThan(revision);
}

/** What the card says of the clicked surface, against the plan's own files and positions. */
async function expectSights(): Promise<number> {
  const { page } = viewer;
  const patch = Number(await page.getByTestId('surface-figures').getAttribute('data-patch'));
  const figures = await viewer.figures('surface-figures');
  const at = figures.Position.split(', ').map(Number);
  const seeing = plan.stations.filter(({ id }) => (files.bytes(`seen/${id}.bits`)[patch >> 3] >> (patch & 7)) & 1);
  if (seeing.length === 0) {
    expect(await sights().count()).toBe(0);
    return 0;
  }
  await sights().first().waitFor();
  const rows = await sightRows();
  expect(rows.map(([id]) => id).sort()).toEqual(seeing.map(({ id }) => id).sort());
  for (const [id, range, incidence] of rows) {
    const [dx, dy, dz] = plan.stations.find((one) => one.id === id)!.position.map((x, k) => x - at[k]);
    expect(Math.abs(Number.parseFloat(range) - Math.hypot(dx, dy, dz))).toBeLessThan(0.02);
    // Of level ground; at what stands upright the wall decides.
    if (figures['Walkable floor'] !== undefined) {
      const degrees = (Math.atan2(Math.hypot(dx, dy), Math.abs(dz)) * 180) / Math.PI;
      expect(Math.abs(Number.parseFloat(incidence) - degrees)).toBeLessThan(1.1);
    }
  }
  expect(rows.map(([, , , best]) => best)).toEqual(['best', ...rows.slice(1).map(() => undefined)]);
  return seeing.length;
}

test('a clicked surface tells which stations see it, from how far and how obliquely, by mouse and by keys', {
  tags: 'main',
}, async () => {
  await open('');
  const { page } = viewer;
  const box = (await marker(stations[0].id).boundingBox())!;
  let nSeen = 0;
  for (const [dx, dy] of [
    [30, 40],
    [-60, 30],
    [-40, -70],
  ]) {
    await page.mouse.click(box.x + dx, box.y + dy);
    await page.getByTestId('surface-figures').waitFor();
    nSeen = Math.max(nSeen, await expectSights());
  }
  expect(nSeen).toBeGreaterThan(1);
  expect(await page.locator('.sight-lines polyline').count()).toBeGreaterThan(1);
  await viewer.screenshot('t-sights');
  await page.getByRole('button', { name: 'Close' }).click();
  expect(await page.locator('.sight-lines polyline').count()).toBe(0);

  await page.getByRole('button', { name: 'Measure', exact: true }).click();
  await page.getByRole('button', { name: 'Surface', exact: true }).click();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Enter');
  await page.getByTestId('surface-figures').waitFor();
  await expectSights();
});

test('a station is added at the clicked surface, and is told among those that see it', async () => {
  await open('');
  const { page } = viewer;
  const box = (await marker(stations[0].id).boundingBox())!;
  await page.mouse.click(box.x + 30, box.y + 60);
  const figures = await viewer.figures('surface-figures');
  const at = figures.Position.split(', ').map(Number);
  const button = page.getByRole('button', { name: 'Add a station here' });
  await expect.poll(() => button.isEnabled()).toBe(true);
  await button.click();
  await expect.poll(async () => Object.values((await review()).stations).filter(({ added }) => added).length).toBe(1);
  const [added] = Object.values((await review()).stations);
  expect(Math.hypot(added.position_m![0] - at[0], added.position_m![1] - at[1])).toBeLessThan(0.7);
  const [id] = Object.keys((await review()).stations);
  // Not under the tripod, where the scanner sees nothing: around it.
  await marker(id).waitFor();
  const spot = (await marker(id).boundingBox())!;
  const seenAt: string[][] = [];
  for (const [dx, dy] of [
    [-110, 40],
    [-90, -60],
    [20, 120],
    [-150, 90],
  ]) {
    await page.mouse.click(spot.x + dx, spot.y + dy);
    await page.locator('.card').getByText('Asking which stations see it').waitFor({ state: 'detached' });
    seenAt.push((await sightRows()).map(([one]) => one));
  }
  expect(
    seenAt.some((ids) => ids.includes(id)),
    JSON.stringify(seenAt),
  ).toBe(true);
  await undo();
});

test('a station goes where its coordinates are typed, by steps too, and not where no tripod can stand', {
  tags: 'main',
}, async () => {
  await openEditing();
  const { page } = viewer;
  const [{ id, position }] = stations;
  await marker(id).click();
  const x = page.getByLabel('x, m', { exact: true });
  expect(await x.inputValue()).toBe(position[0].toFixed(3));
  const toX = (position[0] + 0.25).toFixed(3);
  await x.fill(toX.replace('.', ','));
  await x.press('Enter');
  await expect.poll(async () => (await review()).stations[id]?.position_m?.[0] ?? 0).toBeCloseTo(Number(toX), 3);
  expect((await review()).stations[id].position_m![1]).toBeCloseTo(position[1], 3);
  await page.getByRole('button', { name: 'Move 0.10 m south' }).click();
  await expect.poll(async () => (await review()).stations[id]?.position_m?.[1] ?? 0).toBeCloseTo(position[1] - 0.1, 3);
  await viewer.screenshot('t-coordinates');
  const { revision } = await review();
  await x.fill('-900');
  await x.press('Enter');
  await page.getByText(/No tripod can stand at -900\.00, .* The nearest position is /).waitFor();
  expect((await review()).revision).toBe(revision);
  await undo();
  await undo();
});

test('a station goes to a typed easting, and its scene coordinates follow the map conversion', async () => {
  const { page } = viewer;
  await page.route('**/plan/plan.json', (route) => route.fulfill({ json: withSite(planFolder) }));
  await openEditing();
  const [{ id, position }] = stations;
  await marker(id).click();
  await page.getByRole('radio', { name: 'Site', exact: true }).click();
  const easting = page.getByLabel('Easting, m', { exact: true });
  const [e, n] = siteOf(position);
  expect(await easting.inputValue()).toBe(e.toFixed(3));
  await easting.fill((e + 0.2).toFixed(3));
  await easting.press('Enter');
  await expect.poll(async () => (await review()).stations[id]?.position_m ?? null).not.toBeNull();
  const [movedE, movedN] = siteOf((await review()).stations[id].position_m!);
  expect([movedE - e, movedN - n]).toEqual([expect.closeTo(0.2, 2), expect.closeTo(0, 2)]);
  await undo();
});

test('what is typed before the page has drawn anew counts', async () => {
  const { page } = viewer;
  await page.route('**/plan/plan.json', (route) => route.fulfill({ json: withSite(planFolder) }));
  await openEditing();
  const [{ id, position }] = stations;
  await marker(id).click();
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
  await expect.poll(async () => (await review()).stations[id]?.position_m ?? null).not.toBeNull();
  const [movedE] = siteOf((await review()).stations[id].position_m!);
  expect(movedE - siteOf(position)[0]).toBeCloseTo(0.2, 2);
  await undo();
});

test('several stations are selected with Shift, moved, dragged, locked and removed together, and each is one undo', {
  tags: 'main',
}, async () => {
  await openEditing();
  const { page } = viewer;
  // Two of the living room, where there is room.
  const [a, b] = stations.filter(({ position }) => position[0] > 5.5);
  await marker(a.id).click();
  await marker(b.id).click({ modifiers: ['Shift'] });
  await page.getByRole('heading', { name: '2 stations selected' }).waitFor();
  expect(await marker(a.id).getAttribute('aria-pressed')).toBe('true');
  await page.getByLabel('North, m', { exact: true }).fill('-0.2');
  await page.getByRole('button', { name: 'Move', exact: true }).click();
  const shift = async (id: string, from: readonly number[]): Promise<number[] | null> =>
    ((await review()).stations[id]?.position_m ?? null)?.map((x, k) => Number((x - from[k]).toFixed(3))) ?? null;
  for (const { id, position } of [a, b]) {
    await expect.poll(async () => (await shift(id, position))?.slice(0, 2)).toEqual([0, -0.2]);
  }
  await undo();
  expect(Object.keys((await review()).stations).filter((id) => id === a.id || id === b.id)).toEqual([]);

  const { revision } = await review();
  await page.getByLabel('North, m', { exact: true }).fill('-2');
  await page.getByRole('button', { name: 'Move', exact: true }).click();
  await page.getByText(/^No valid tripod position for S\d+ there: .*Nothing was moved\.$/).waitFor();
  expect((await review()).revision).toBe(revision);

  const box = (await marker(a.id).boundingBox())!;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 6; i++) await page.mouse.move(x + 3 * i, y + 2 * i);
  await page.mouse.up();
  await expect.poll(async () => (await shift(b.id, b.position)) !== null).toBe(true);
  const [ofA, ofB] = [await shift(a.id, a.position), await shift(b.id, b.position)];
  expect(ofA!.slice(0, 2)).toEqual(ofB!.slice(0, 2).map((m) => expect.closeTo(m, 2)));
  expect(Math.hypot(ofA![0], ofA![1])).toBeGreaterThan(0.05);
  await undo();

  await page.getByRole('button', { name: 'Lock', exact: true }).click();
  await expect.poll(async () => Object.values((await review()).stations).filter(({ locked }) => locked).length).toBe(2);
  await undo();
  await page.keyboard.press('Delete');
  await expect
    .poll(async () => Object.values((await review()).stations).filter(({ removed }) => removed).length)
    .toBe(2);
  await viewer.screenshot('t-several');
  await undo();
  await page.keyboard.press('Escape');
  expect(await page.getByRole('heading', { name: /stations? selected/ }).count()).toBe(0);
});
