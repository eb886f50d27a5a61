/** Reviewing in real browsers: remarks, verdicts, sign-off; two people at once; a server that is killed. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, beforeAll, expect, inject, test, vi } from 'vitest';
import type { Change, Review } from '../src/api/documents.ts';
import { type PlanJson, parsePlan } from '../src/load/plan-json.ts';
import { launchBrowser, ViewerPage } from './browser.ts';
import { type PlanServer, sceneOf, serveCopy, servePlan } from './plan-server.ts';

vi.setConfig({ testTimeout: 300_000, hookTimeout: 300_000 });

const planFolder = inject('planFolder');
const plan: PlanJson = parsePlan(JSON.parse(readFileSync(join(planFolder, 'plan.json'), 'utf8')));
const [first, second] = plan.stations;
const LOOK = { width: 900, height: 640 };

let browser: Browser;
let server: PlanServer;
beforeAll(async () => {
  browser = await launchBrowser();
  server = await serveCopy(planFolder);
});
afterAll(async () => {
  await browser.close();
  await server.stop();
});

async function openAs(name: string, hash = '#tab=review'): Promise<ViewerPage> {
  const viewer = await ViewerPage.create(browser, server.address, LOOK);
  await viewer.open(hash);
  await viewer.page.getByLabel('Your name, for changes and comments').fill(name);
  return viewer;
}
async function close(viewer: ViewerPage): Promise<void> {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
}
const review = (viewer: ViewerPage): Promise<Review> =>
  viewer.page.evaluate(async () => (await fetch('api/review')).json());

/** Change the review behind the page's back, as another program would. */
async function changeAs(viewer: ViewerPage, author: string, ...changes: readonly Change[]): Promise<number> {
  const { revision } = await review(viewer);
  return viewer.page.evaluate(
    async (body) => {
      const headers = { 'content-type': 'application/json' };
      return (await fetch('api/review/changes', { method: 'POST', headers, body: JSON.stringify(body) })).status;
    },
    { base_revision: revision, author, changes },
  );
}

test('comments are pinned to stations and surfaces, shown as text, and resolved', async () => {
  const viewer = await openAs('Ada', `#tab=review&floor=${first.floor}`);
  const { page } = viewer;
  const text = page.getByLabel('New comment');
  const post = page.getByRole('button', { name: 'Comment', exact: true });
  await text.fill('<img src=x onerror="document.title=1"> too near to the *door*');
  await page.locator(`.marker[data-station="${first.id}"]`).click({ timeout: 120_000 });
  await page.getByRole('button', { name: `Pin to ${first.id}`, exact: true }).click();
  await post.click();
  const entry = page.locator('[data-comment]').first();
  await entry.waitFor();
  expect(await entry.textContent()).toContain('<img src=x onerror="document.title=1"> too near');
  expect(await entry.locator('img').count()).toBe(0);
  expect(Object.values((await review(viewer)).comments)[0]).toMatchObject({ author: 'Ada', target: first.id });

  await page.getByRole('button', { name: 'Pin to a surface' }).click();
  const canvas = (await page.locator('canvas').first().boundingBox())!;
  // Beside the middle, where the chosen station stands, and beside its card.
  await page.mouse.click(canvas.x + canvas.width / 2 - 110, canvas.y + canvas.height / 2 - 30);
  await page.getByText(/^On (?!the plan)/).waitFor();
  await text.fill('Is this wall still there?');
  await post.click();
  await expect.poll(() => page.locator('[data-comment]').count()).toBe(2);
  const pinned = Object.values((await review(viewer)).comments).find(({ target }) => typeof target === 'number');
  expect(pinned?.position_m).toHaveLength(3);
  await viewer.screenshot('review-1-comments');

  await page.getByRole('button', { name: 'Resolve' }).first().click();
  await expect
    .poll(async () => Object.values((await review(viewer)).comments).some(({ resolved }) => resolved))
    .toBe(true);
  await close(viewer);
});

test('stations are accepted and rejected, and the plan is signed off', async () => {
  const viewer = await openAs('Grace');
  const { page } = viewer;
  await page.getByRole('button', { name: `Accept ${first.id}`, exact: true }).click();
  await page.getByRole('button', { name: `Reject ${second.id}`, exact: true }).click();
  await expect.poll(async () => (await review(viewer)).verdicts[second.id]?.verdict).toBe('rejected');
  expect((await review(viewer)).verdicts[first.id]).toMatchObject({ verdict: 'accepted', by: 'Grace' });
  await page.getByRole('button', { name: /^Accept the other/ }).click();
  await expect.poll(async () => Object.keys((await review(viewer)).verdicts).length).toBe(plan.stations.length);
  await page.getByRole('button', { name: 'Sign off as Grace' }).click();
  await page.getByTestId('signature').waitFor();
  expect(await page.getByTestId('signature').textContent()).toMatch(/Grace signed at .*Nothing was changed since/);
  expect(await changeAs(viewer, 'Ada', { kind: 'lock_station', station: first.id, locked: true })).toBe(200);
  await expect
    .poll(() => page.getByTestId('signature').textContent(), { timeout: 30_000 })
    .toContain('1 thing changed since');
  await viewer.screenshot('review-2-signed');
  await close(viewer);
});

test('two people who change the same station are told of each other, and neither loses anything', async () => {
  const ada = await openAs('Ada', '#tab=edit');
  const grace = await openAs('Grace', '#tab=review');
  const { id } = plan.stations[2];
  // Ada's page does not hear of it: as if both had changed it at the same moment.
  await ada.page.route('**/api/review', (route) => route.abort());
  await ada.page.getByRole('tab', { name: 'Review' }).click();
  expect(await changeAs(grace, 'Grace', { kind: 'set_verdict', station: id, verdict: 'rejected' })).toBe(200);
  await ada.page.getByRole('button', { name: `Reject ${id}`, exact: true }).click();
  await ada.page.getByRole('alertdialog').waitFor();
  expect(await ada.page.getByRole('alertdialog').textContent()).toMatch(
    new RegExp(`Grace changed verdict ${id} at \\d\\d:\\d\\d`),
  );
  await ada.screenshot('review-3-conflict');
  expect((await review(grace)).verdicts[id].by).toBe('Grace');
  await ada.page.getByRole('button', { name: 'Apply mine again' }).click();
  await expect.poll(async () => (await review(grace)).verdicts[id].by).toBe('Ada');
  // What one commits shows on the other's page without asking.
  await grace.page.getByText('rejected by Ada').first().waitFor({ timeout: 30_000 });
  await close(grace);
  await ada.page.close();
});

test('a server that is killed has lost nothing it has answered', async () => {
  const viewer = await openAs('Ada', '#tab=review');
  await viewer.page.getByLabel('New comment').fill('Before the power went');
  await viewer.page.getByRole('button', { name: 'Comment', exact: true }).click();
  await viewer.page.getByText('Before the power went').waitFor();
  const before = await review(viewer);
  await server.stop('SIGKILL');
  await viewer.page.getByText('The server does not answer').waitFor({ timeout: 60_000 });
  await viewer.page.getByLabel('New comment').fill('While it was away');
  await viewer.page.getByRole('button', { name: 'Comment', exact: true }).click();
  await viewer.page.getByRole('alert').waitFor();
  // What could not be sent is still there to be sent again.
  expect(await viewer.page.getByLabel('New comment').inputValue()).toBe('While it was away');
  await viewer.page.close();
  server = await servePlan(server.folder, sceneOf(planFolder));
  const again = await openAs('Ada');
  expect(await review(again)).toEqual(before);
  await again.page.getByText('Before the power went').waitFor();
  await close(again);
});
