/** What people take along: a link, a picture, and exports of the plan as edited; and who may only comment. */
import { readFileSync } from 'node:fs';
import type { Page } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test } from 'vitest';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';

const planFolder = inject('planFolder');
const own = ownCopy(planFolder);
let viewer: ViewerPage;
let page: Page;

beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 1180, height: 820 });
  page = viewer.page;
});
afterEach(() => page.close());

const share = () => page.getByRole('button', { name: 'Share' });
const menu = () => page.getByRole('region', { name: 'Share and download' });

async function downloaded(name: string): Promise<{ file: string; bytes: Buffer }> {
  const [download] = await Promise.all([page.waitForEvent('download'), menu().getByRole('button', { name }).click()]);
  return { file: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
}

test('a station list, issues and sheets are made by the server and saved under their names', {
  tags: 'main',
}, async () => {
  await viewer.open();
  await share().click();
  const list = await downloaded('Station list');
  expect(list.file).toBe('stations.csv');
  expect(list.bytes.toString()).toMatch(/^name,easting_m/);
  const issues = await downloaded('Issues');
  expect([issues.file, issues.bytes.subarray(0, 2).toString()]).toEqual(['issues.bcfzip', 'PK']);
  await viewer.screenshot('share-menu');
  const sheets = await downloaded('Sheets to print');
  expect([sheets.file, sheets.bytes.subarray(0, 5).toString()]).toEqual(['sheets.pdf', '%PDF-']);
  expect(viewer.faults).toEqual([]);
});

test('a picture has the scene with its numbers, a title and the legend', async () => {
  await viewer.open('#floor=F0');
  await share().click();
  const { file, bytes } = await downloaded('Picture');
  expect(file).toBe('house-F0.png');
  const { width, height } = (await page.locator('.scene').boundingBox())!;
  expect(bytes.subarray(1, 4).toString()).toBe('PNG');
  expect([bytes.readUInt32BE(16), bytes.readUInt32BE(20)]).toEqual([width, height + 56]);
  // Far more than a background: the building, numbers and texts are in it.
  expect(bytes.length).toBeGreaterThan(40_000);
  const { writeFileSync } = await import('node:fs');
  writeFileSync(new URL('../test-results/share-picture.png', import.meta.url), bytes);
});

test('a copied link shows the same to whoever opens it: floor, station, layer and camera', async () => {
  await viewer.open('#floor=F1&layer=range');
  await page.getByRole('button', { name: 'Top', exact: true }).click();
  await viewer.settle();
  await share().click();
  await menu().getByRole('button', { name: 'Copy link' }).click();
  const link = await menu().getByRole('textbox', { name: 'Link to this view' }).inputValue();
  expect(link).not.toContain('token');
  const hash = new URL(link).hash;
  expect(hash).toMatch(/floor=F1.*layer=range.*camera=/);
  const before = await viewer.canvasPixels();
  await page.goto('about:blank');
  await page.goto(link);
  await page.locator('.marker:not([hidden])').first().waitFor();
  await viewer.settle();
  expect(before.shareChanged(await viewer.canvasPixels())).toBeLessThan(0.02);
});

test('who may only comment does so, and is told why nothing else can be done', { tags: 'main' }, async () => {
  await page.goto(own.server.commentAddress);
  await page.locator('.marker:not([hidden])').first().waitFor();
  await page.getByRole('tab', { name: 'Edit' }).click();
  expect(await page.locator('.tab-page .callout').textContent()).toMatch(/for comments and verdicts/);
  await viewer.screenshot('comment-only-edit');
  await page.getByRole('tab', { name: 'Runs' }).click();
  expect(await page.locator('.tab-page .callout').textContent()).toMatch(/for comments and verdicts/);
  await page.getByRole('tab', { name: 'Review' }).click();
  await page.getByLabel('Your name').fill('Site manager');
  await page.getByRole('textbox', { name: 'New comment' }).fill('The hall is full until Friday.');
  await page.getByRole('button', { name: 'Comment', exact: true }).click();
  await page.getByText('The hall is full until Friday.').first().waitFor();
  await page.getByRole('button', { name: 'Reject S001' }).click();
  await page
    .getByText(/rejected by Site manager/)
    .first()
    .waitFor();
  expect(await page.getByRole('button', { name: /^Sign off/ }).count()).toBe(0);
  await viewer.screenshot('comment-only-review');
  const refused = await page.evaluate(async () => {
    const changes = [{ kind: 'remove_station', station: 'S001' }];
    const body = JSON.stringify({ base_revision: 2, author: 'Site manager', changes });
    const headers = { 'content-type': 'application/json' };
    return (await fetch('api/review/changes', { method: 'POST', headers, body })).status;
  });
  expect(refused).toBe(403);
});
