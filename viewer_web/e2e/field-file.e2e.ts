/** The field file on a phone, opened as a file without a server or a network; and its result taken into the review. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, expect, inject, test } from 'vitest';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';
import { PYTHON, REPOSITORY } from './plan-server.ts';

const { plan } = new PlanFiles(inject('planFolder'));
const [first, second, third, fourth] = plan.route!.order.map((id) => plan.stations.find((one) => one.id === id)!);

const openPage = viewerPages({ width: 1024, height: 768 });
let folder: string;
let file: string;
beforeAll(() => {
  folder = mkdtempSync(join(tmpdir(), 'tlsplan-field-'));
  file = join(folder, 'field.html');
  execFileSync(PYTHON, ['-m', 'tlsplan', 'export', inject('planFolder'), '--format', 'field', '-o', file, '--quiet'], {
    cwd: REPOSITORY,
    stdio: ['ignore', 'ignore', 'inherit'],
  });
});
afterAll(() => rmSync(folder, { recursive: true, force: true }));

test('done, moved, skipped, notes and photos stay over a reload, and go into the review by its revision', async () => {
  const phone = await openPage({ width: 390, height: 844, hasTouch: true, isMobile: true }, `file://${file}`);
  const { page } = phone;
  await page.context().setOffline(true);
  await page.goto(`file://${file}`);
  const station = page.locator('#station');
  expect(await station.textContent()).toBe(first.id);
  expect(await page.locator('#place').textContent()).toMatch(/^(x -?\d+\.\d\d, y -?\d|E -?\d+\.\d\d, N -?\d)/);
  await phone.screenshot('field-file-1-opened');
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
  await page.locator('#act-done').tap();
  await expect.poll(() => station.textContent()).toBe(second.id);
  await page.locator('#act-moved').tap();
  await page.locator('svg').scrollIntoViewIfNeeded();
  const map = (await page.locator('svg').boundingBox())!;
  await page.touchscreen.tap(map.x + map.width / 2, map.y + map.height / 2);
  await page.getByText(/^Moved by \d/).waitFor();
  await page.locator('#photo').check();
  await phone.screenshot('field-file-2-moved');
  await page.locator('#act-done').tap();
  await expect.poll(() => station.textContent()).toBe(third.id);
  await page.locator('#note').fill('Door locked, no key');
  await page.locator('#act-skipped').tap();
  await expect.poll(() => station.textContent()).toBe(fourth.id);
  await page.locator('#name').fill('Ada');
  await page.reload();
  expect(await page.locator('#count').textContent()).toBe(`2 of ${plan.stations.length} done`);
  expect(await station.textContent()).toBe(fourth.id);
  expect(await page.locator('#name').inputValue()).toBe('Ada');
  await phone.screenshot('field-file-3-kept');
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator('#save').tap()]);
  const saved = join(folder, 'result.json');
  await download.saveAs(saved);
  expect(JSON.parse(readFileSync(saved, 'utf8'))).toMatchObject({
    schema: 'tlsplan/field/1',
    revision: 0,
    name: 'Ada',
    coordinates: expect.any(String),
  });

  const viewer = await openPage();
  await viewer.open('#tab=review');
  const chooser = viewer.page.getByLabel('What the crew saved from the field file');
  await chooser.setInputFiles(saved);
  await expect.poll(async () => Object.keys((await viewer.review()).comments)).toHaveLength(3);
  const { stations, comments } = await viewer.review();
  const [x, y] = stations[second.id].position_m!;
  expect(Math.hypot(x - second.position[0], y - second.position[1])).toBeGreaterThan(0.2);
  const texts = Object.values(comments).map(({ target, text }) => [target, text]);
  expect(texts).toContainEqual([third.id, 'On site (Ada): skipped; Door locked, no key']);
  expect(texts).toContainEqual([null, expect.stringContaining(`2 of ${plan.stations.length} stations done`)]);
  await viewer.screenshot('field-file-4-taken-in');
  // The same file again would overwrite what was done since, and says so.
  await chooser.setInputFiles(saved);
  await viewer.page.getByRole('alertdialog').waitFor();
  await viewer.page.getByRole('button', { name: 'Keep theirs' }).click();
  expect(Object.keys((await viewer.review()).comments)).toHaveLength(3);
  expect(viewer.faults.splice(0).filter((fault) => !/409/.test(fault))).toEqual([]);
});
