/** Rooms in a real browser: their list against the plan folder's files, their names in the picture and on the field map. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expect, inject, test } from 'vitest';
import { removeStation } from '../src/edit/changes.ts';
import { NOT_ACHIEVABLE } from '../src/heat/layers.ts';
import { patchAreas } from '../src/heat/statistics.ts';
import { readStage } from '../src/load/stage.ts';
import { reachedPercent } from '../src/panels/figures.ts';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const files = new PlanFiles(planFolder);
const { plan, ground } = files;
const openPage = viewerPages({ width: 1280, height: 800 });

/** Coverage of each room of a floor, from the files alone. */
function coverages(floorId: string): Map<string, string> {
  const { rooms, counted } = files.layers;
  const [ofPatch, seen] = [files.values(rooms!.file), files.bytes('patches.u8')];
  const stage = readStage(new Uint8Array(readFileSync(join(planFolder, 'viewer/stage.usdc'))).buffer);
  const areasM2 = patchAreas(stage.triangles, seen.length, counted === null ? null : files.bytes(counted));
  return new Map(
    rooms!.list.flatMap(({ name, floor }, number) => {
      let [coveredM2, scannableM2] = [0, 0];
      ofPatch.forEach((room, patch) => {
        if (room !== number || seen[patch] === NOT_ACHIEVABLE) return;
        scannableM2 += areasM2[patch];
        if (seen[patch] > 0) coveredM2 += areasM2[patch];
      });
      return floor === floorId ? [[name, reachedPercent(coveredM2 / scannableM2, plan.requirements.coverage)]] : [];
    }),
  );
}

test('rooms are listed with their coverage, opened by a click, named in the picture and on the field map', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open();
  const list = page.getByRole('list', { name: 'Rooms' });
  const expected = coverages(ground.id);
  expect(expected.size).toBeGreaterThan(2);
  await page.locator(`[data-floor="${ground.id}"]`).click();
  await expect
    .poll(async () =>
      Object.fromEntries(
        await list
          .locator('[data-room]')
          .evaluateAll((rows) =>
            rows.map((row) => [
              row.querySelector('.row-name')?.textContent ?? '',
              row.querySelector('.row-figure > span')?.textContent ?? '',
            ]),
          ),
      ),
    )
    .toEqual(Object.fromEntries(expected));
  // Every station of the floor stands in one room.
  await expect
    .poll(async () => (await list.textContent())?.match(/S\d{3}/g)?.sort())
    .toEqual(files.stationsOf(ground.id).map(({ id }) => id));

  await page.locator('[data-floor=all]').click();
  const names = page.locator('.room-name:visible');
  await page.getByText('Spread floors apart').uncheck();
  await expect.poll(() => names.count()).toBe(0);
  const before = await viewer.canvasPixels();
  const [worst] = await list.locator('.row-name').allTextContents();
  await list.locator('[data-room]').first().click();
  await expect.poll(() => list.locator('[data-room][aria-pressed=true] .row-name').textContent()).toBe(worst);
  await expect.poll(() => viewer.hash()).toContain('floor=');
  await expect.poll(() => page.locator('.room-name-chosen:visible').textContent()).toBe(worst);
  await expect.poll(async () => before.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.2);
  await viewer.screenshot('rooms-chosen');

  const painted = await viewer.canvasPixels();
  await page.getByLabel('Colour of the building').selectOption({ label: 'Coverage by room' });
  await expect.poll(() => page.getByTestId('legend').textContent()).toContain('95 % and more');
  await expect.poll(async () => painted.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.05);
  await page.getByLabel('Names of rooms in the picture').uncheck();
  await expect.poll(() => names.count()).toBe(0);

  await page.getByRole('button', { name: 'Field view' }).click();
  const floorOf = (id: string) => plan.stations.find((station) => station.id === id)?.floor;
  const first = [...plan.stations].sort((a, b) => a.order - b.order)[0];
  await expect
    .poll(async () => (await page.locator('.map-room').allTextContents()).sort())
    .toEqual([...coverages(floorOf(first.id) ?? '').keys()].sort());
});

test('a station that is moved away changes the coverage and the stations of its room at once', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.openEditing(`floor=${ground.id}`);
  await page.getByRole('tab', { name: 'Plan' }).click();
  const row = page.locator('[data-room]', { hasText: 'WC' });
  const [alone] = ((await row.textContent())?.match(/S\d{3}/g) ?? []) as string[];
  const before = await row.locator('.row-figure > span').textContent();
  expect(await viewer.changeAs('Somebody', removeStation(alone))).toBe(200);
  await expect.poll(() => row.textContent()).toContain('no station');
  await expect.poll(() => row.locator('.row-figure > span').textContent()).not.toBe(before);
  await expect.poll(() => row.textContent()).toContain('left unseen by edits');
});
