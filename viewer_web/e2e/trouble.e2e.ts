/** What goes wrong beside the page, stated on it in words, with the way out: a damaged review, a missing scene, another start of the server. */
import { cpSync, mkdtempSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, inject, test } from 'vitest';
import { viewerPages } from './browser.ts';
import { servePlan } from './plan-server.ts';

const openPage = viewerPages({ width: 960, height: 600 });

test('a damaged review and a missing scene are reported, and a page goes on when they are mended or the server comes back', async () => {
  const own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-trouble-'));
  const folder = join(own, 'plan');
  cpSync(inject('planFolder'), folder, { recursive: true });
  const review = join(folder, 'review.usda');
  writeFileSync(review, '#usda 1.0\n(\n');
  const first = await servePlan(folder);
  const viewer = await openPage({}, first.address);
  const { page } = viewer;
  await viewer.open('#tab=edit');
  const trouble = page.getByTestId('trouble');
  await trouble.getByText('the review is damaged (line 3: it breaks off)').waitFor();
  await expect.poll(() => page.locator('.callout').first().textContent()).toContain('rename it to begin a new review');
  await expect
    .poll(() => page.locator('body').textContent())
    .not.toMatch(/Start `tlsplan view` again|only shows files/);
  await page.getByRole('tab', { name: 'Runs' }).click();
  await expect.poll(() => page.locator('.callout').first().textContent()).toContain('the review is damaged');
  await viewer.screenshot('trouble-1-review');

  renameSync(review, join(folder, 'damaged.usda'));
  await page.getByRole('button', { name: 'Start' }).waitFor();
  await page.getByText(/No run can be started: .*house.ifc is not found.*--scene/).waitFor();
  await expect.poll(() => page.getByRole('button', { name: 'Start' }).isDisabled()).toBe(true);
  await expect.poll(() => trouble.count()).toBe(0);
  await viewer.screenshot('trouble-2-scene');

  const port = Number(new URL(first.address).port);
  await first.stop();
  await trouble.getByText('The server does not answer; retrying.').waitFor();
  const second = await servePlan(folder, '', port);
  await trouble.getByText('The server was started again').waitFor();
  await expect.poll(() => trouble.textContent()).toContain('open the address that `tlsplan view` printed');
  await expect.poll(() => page.locator('body').textContent()).not.toContain('does not answer');
  await viewer.screenshot('trouble-3-started-again');
  await page.reload();
  await page.getByText('The server was started again').waitFor();
  await expect.poll(() => page.locator('body').textContent()).not.toMatch(/answered 401/);

  await page.goto(second.address);
  await page.locator('.marker:not([hidden])').first().waitFor();
  expect(viewer.faults.splice(0).filter((fault) => !/Failed to load resource|ERR_/.test(fault))).toEqual([]);
  await page.close();
  await second.stop();
  rmSync(own, { recursive: true, force: true });
});

test('a page goes on with another start of a server that keeps its links', async () => {
  const own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-kept-'));
  const folder = join(own, 'plan');
  cpSync(inject('planFolder'), folder, { recursive: true });
  const serve = () => servePlan(folder, '', 0, join(own, 'cache'));
  const first = await serve();
  const viewer = await openPage({}, first.address);
  const { page } = viewer;
  await viewer.open('#tab=edit');
  await first.stop();
  const trouble = page.getByTestId('trouble');
  await trouble.getByText('The server does not answer; retrying.').waitFor();

  const second = await serve();
  expect([second.address, second.commentAddress]).toEqual([first.address, first.commentAddress]);
  await trouble.waitFor({ state: 'detached' });
  await page.reload();
  await page.locator('.marker:not([hidden])').first().waitFor();
  await expect.poll(() => trouble.count()).toBe(0);
  expect(viewer.faults.splice(0).filter((fault) => !/Failed to load resource|ERR_/.test(fault))).toEqual([]);
  await page.close();
  await second.stop();
  rmSync(own, { recursive: true, force: true });
});
