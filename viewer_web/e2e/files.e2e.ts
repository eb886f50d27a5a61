/** A plan of several files: each is switched off and on as a whole. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, test } from 'vitest';
import { launchBrowser, ViewerPage } from './browser.ts';
import { PlanFiles } from './plan-files.ts';
import { type PlanServer, REPOSITORY, servePlan } from './plan-server.ts';

let browser: Browser;
let own: string;
let server: PlanServer;
let viewer: ViewerPage;

beforeAll(async () => {
  browser = await launchBrowser();
  own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-files-'));
  const python = process.env.TLSPLAN_PYTHON ?? `${REPOSITORY}.venv/bin/python`;
  execFileSync(python, ['viewer_web/e2e/plan_files.py', join(own, 'plan')], { cwd: REPOSITORY });
  server = await servePlan(join(own, 'plan'));
});
afterAll(async () => {
  await browser.close();
  await server.stop();
  rmSync(own, { recursive: true, force: true });
});
beforeEach(async () => {
  viewer = await ViewerPage.create(browser, server.address, { width: 1280, height: 800 });
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

const tick = (name: string) => viewer.page.getByRole('group', { name: 'Files' }).getByLabel(name);
const isPurple = ([r, g, b]: readonly number[]): boolean => b > g + 25 && r > g + 12;

/** Names of the elements that clicks all over the canvas find. */
async function clicked(): Promise<Set<string>> {
  const names = new Set<string>();
  const { page } = viewer;
  for (let x = 480; x < 1200; x += 60) {
    for (let y = 120; y < 760; y += 60) {
      const isBare = await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS', [x, y]);
      if (!isBare) continue;
      await page.mouse.click(x, y);
      const card = page.getByLabel('Clicked surface');
      if ((await card.count()) === 0) continue;
      names.add((await card.locator('h2').textContent()) ?? '');
      await card.getByRole('button', { name: 'Close' }).click();
    }
  }
  return names;
}

test('a file that is switched off is neither drawn nor clicked, and an unseen piece of it switches it on', async () => {
  const { plan } = new PlanFiles(server.folder);
  const lowest = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
  await viewer.open(`#floor=${lowest.id}&layer=plain`);
  const { page } = viewer;
  expect(await page.getByRole('group', { name: 'Files' }).locator('label').allTextContents()).toEqual([
    'walls.ifc',
    'rest.ifc',
  ]);
  await page.keyboard.press('t');
  await viewer.settle();
  const all = await viewer.canvasPixels();
  expect([...(await clicked())].filter((name) => name.endsWith('(walls.ifc)')).length).toBeGreaterThan(0);

  await tick('walls.ifc').uncheck();
  await viewer.settle();
  const withoutWalls = await viewer.canvasPixels();
  expect(all.shareChanged(withoutWalls)).toBeGreaterThan(0.02);
  const left = [...(await clicked())];
  expect(left.length).toBeGreaterThan(0);
  expect(left.filter((name) => !name.endsWith('(rest.ifc)'))).toEqual([]);
  await viewer.screenshot('f-without-walls');
  expect(await viewer.hash()).toContain('without=0');

  // The address has it, so others see the same.
  const theirs = await ViewerPage.create(browser, server.address, { width: 1280, height: 800 });
  await theirs.open(await viewer.hash());
  expect(await theirs.page.getByRole('group', { name: 'Files' }).getByLabel('walls.ifc').isChecked()).toBe(false);
  await theirs.page.close();

  await page.getByRole('tab', { name: 'Unseen' }).click();
  await page.getByRole('list', { name: 'Unseen surfaces' }).getByText('(walls.ifc)').first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isPurple)).toBeGreaterThan(0.002);
  await page.getByRole('tab', { name: 'Plan', exact: true }).click();
  expect(await tick('walls.ifc').isChecked()).toBe(true);
  // Hidden again, its mark is hidden with it.
  await tick('walls.ifc').uncheck();
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isPurple)).toBeLessThan(0.0005);
  await viewer.screenshot('f-mark-hidden');
});

test('a plan of one file has no list of files', async () => {
  const one = await ViewerPage.create(browser, inject('address'));
  await one.open();
  expect(await one.page.locator('[data-floor]').count()).toBeGreaterThan(1);
  expect(await one.page.getByRole('group', { name: 'Files' }).count()).toBe(0);
  await one.page.close();
});
