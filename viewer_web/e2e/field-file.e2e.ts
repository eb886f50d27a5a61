/** The field file on a phone, opened as a file without a server or a network; and its result taken into the review. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Page } from 'playwright-core';
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

type Line = readonly [number, number, number, number];

/** What the map of the chosen station's floor is drawn of, scene frame. */
const mapLines = (page: Page): Promise<Line[]> =>
  page.evaluate(() => {
    const drawn = document.querySelector('svg path.wall')!.getAttribute('d')!;
    return drawn
      .split('M')
      .flatMap((path) => {
        const points = path.split('L').map((point) => point.split(',').map(Number));
        return points
          .slice(1)
          .map(([x, y], i): [number, number, number, number] => [...(points[i] as [number, number]), x, y]);
      })
      .map(([x1, y1, x2, y2]): [number, number, number, number] => [x1, -y1, x2, -y2]);
  });

function nearestOn([x1, y1, x2, y2]: Line, [x, y]: readonly number[]): [number, number] {
  const [dx, dy] = [x2 - x1, y2 - y1];
  const along = Math.min(1, Math.max(0, ((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy || 1)));
  return [x1 + along * dx, y1 + along * dy];
}
const distance = ([a, b]: readonly number[], [x, y]: readonly number[]): number => Math.hypot(a - x, b - y);
const awayFrom = (lines: readonly Line[], at: readonly number[]): number =>
  Math.min(...lines.map((line) => distance(nearestOn(line, at), at)));
const nearestWall = (lines: readonly Line[], at: readonly number[]): [number, number] =>
  lines.map((line) => nearestOn(line, at)).sort((a, b) => distance(a, at) - distance(b, at))[0];
/** Where a place of the scene is on the page. */
const onPage = (page: Page, x: number, y: number): Promise<[number, number]> =>
  page.evaluate(
    ([sx, sy]) => {
      const at = new DOMPoint(sx, -sy).matrixTransform(document.querySelector('svg')!.getScreenCTM()!);
      return [at.x, at.y] as [number, number];
    },
    [x, y],
  );

test('done, moved, skipped, notes and photos stay over a reload, and go into the review by its revision', async () => {
  const phone = await openPage({ width: 390, height: 844, hasTouch: true, isMobile: true }, `file://${file}`);
  const { page } = phone;
  await page.context().setOffline(true);
  await page.goto(`file://${file}`);
  const station = page.locator('#station');
  await expect.poll(() => station.textContent()).toBe(first.id);
  await expect
    .poll(() => page.locator('#place').textContent())
    .toMatch(/^(x -?\d+\.\d\d, y -?\d|E -?\d+\.\d\d, N -?\d)/);
  await phone.screenshot('field-file-1-opened');
  await expect.poll(() => page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
  await page.locator('#act-done').tap();
  await expect.poll(() => station.textContent()).toBe(second.id);
  await page.locator('#act-moved').tap();
  await page.locator('svg').scrollIntoViewIfNeeded();
  const map = (await page.locator('svg').boundingBox())!;
  await page.touchscreen.tap(map.x + map.width / 2, map.y + map.height / 2);
  await page.getByText(/^Moved by \d/).waitFor();
  await page.locator('#act-moved').tap();
  // Into the wall that is nearest to the station: a tripod stands beside it.
  const [wallX, wallY] = nearestWall(await mapLines(page), second.position);
  await page.locator('svg').scrollIntoViewIfNeeded();
  await page.touchscreen.tap(...(await onPage(page, wallX, wallY)));
  await page.getByText(/^Set \d\.\d\d m beside the tap, where a tripod stands/).waitFor();
  const kept = await page.evaluate(() => JSON.parse(Object.values(localStorage)[0] as string));
  const moved = kept.stations[second.id].moved_to;
  expect(awayFrom(await mapLines(page), moved)).toBeGreaterThan(0.25);
  await page.locator('#act-near').tap();
  await phone.screenshot('field-file-2-near');
  await page.locator('#act-near').tap();
  await page.locator('#photo').check();
  await phone.screenshot('field-file-2-moved');
  await page.locator('#act-done').tap();
  await expect.poll(() => station.textContent()).toBe(third.id);
  await page.locator('#note').fill('Door locked, no key');
  await page.locator('#act-skipped').tap();
  await expect.poll(() => station.textContent()).toBe(fourth.id);
  await page.locator('#name').fill('Ada');
  await page.reload();
  await expect.poll(() => page.locator('#count').textContent()).toBe(`2 of ${plan.stations.length} done`);
  await expect.poll(() => station.textContent()).toBe(fourth.id);
  await expect.poll(() => page.locator('#name').inputValue()).toBe('Ada');
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
  await viewer.openEditing('');
  await viewer.page.getByRole('tab', { name: 'Review' }).click();
  const chooser = viewer.page.getByLabel('What the crew saved from the field file');
  const walled = join(folder, 'walled.json');
  const result = JSON.parse(readFileSync(saved, 'utf8'));
  const intoWall = { ...result.stations[1], moved_to: [wallX, wallY] };
  writeFileSync(walled, JSON.stringify({ ...result, stations: [result.stations[0], intoWall, result.stations[2]] }));
  await chooser.setInputFiles(walled);
  const accept = viewer.page.getByLabel(`Move ${second.id} in the plan`);
  await accept.waitFor();
  await expect.poll(() => accept.isChecked()).toBe(false);
  await viewer.page.getByText('No tripod stands there').waitFor();
  await viewer.screenshot('field-file-4-walled');
  await viewer.page.getByRole('button', { name: 'Cancel' }).click();
  await chooser.setInputFiles(saved);
  await expect.poll(() => accept.isChecked()).toBe(true);
  await viewer.page.getByRole('button', { name: 'Take in the result' }).click();
  await expect.poll(async () => Object.keys((await viewer.review()).comments)).toHaveLength(3);
  const { stations, comments, progress } = await viewer.review();
  const [x, y] = stations[second.id].position_m!;
  expect([x, y]).toEqual(moved);
  const texts = Object.values(comments).map(({ target, text }) => [target, text]);
  expect(texts).toContainEqual([third.id, 'On site (Ada): skipped; Door locked, no key']);
  expect(texts).toContainEqual([null, expect.stringContaining(`2 of ${plan.stations.length} stations done`)]);
  const states = [first, second, third].map(({ id }) => progress[id].state);
  expect(states).toEqual(['done', 'done', 'skipped']);
  await viewer.screenshot('field-file-4-taken-in');
  // The same file again would overwrite what was done since, and says so.
  await chooser.setInputFiles(saved);
  await viewer.page.getByRole('button', { name: 'Take in the result' }).click();
  await viewer.page.getByRole('alertdialog').waitFor();
  await viewer.page.getByRole('button', { name: 'Keep theirs' }).click();
  expect(Object.keys((await viewer.review()).comments)).toHaveLength(3);
  expect(viewer.faults.splice(0).filter((fault) => !/409/.test(fault))).toEqual([]);
});
