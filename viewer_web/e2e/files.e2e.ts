/** A plan of several files: each is switched off and on as a whole. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';
import { type PlanServer, PYTHON, REPOSITORY, servePlan } from './plan-server.ts';

let own: string;
let server: PlanServer;
const openPage = viewerPages({ width: 1280, height: 800 });
beforeAll(async () => {
  own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-files-'));
  execFileSync(PYTHON, ['viewer_web/e2e/plan_files.py', join(own, 'plan')], { cwd: REPOSITORY });
  server = await servePlan(join(own, 'plan'));
});
afterAll(async () => {
  await server.stop();
  rmSync(own, { recursive: true, force: true });
});

const isPurple = ([r, g, b]: readonly number[]): boolean => b > g + 25 && r > g + 12;

/** Names of the elements that clicks all over the canvas find. */
async function clicked(viewer: ViewerPage): Promise<string[]> {
  const names = new Set<string>();
  const { page } = viewer;
  for (let x = 480; x < 1200; x += 120) {
    for (let y = 120; y < 760; y += 120) {
      if (!(await viewer.isBare(x, y))) continue;
      await page.mouse.click(x, y);
      const card = page.getByLabel('Clicked surface');
      if ((await card.count()) === 0) continue;
      names.add((await card.locator('h2').textContent()) ?? '');
      await card.getByRole('button', { name: 'Close' }).click();
    }
  }
  return [...names];
}

test('a file that is switched off is neither drawn nor clicked, and an unseen piece of it switches it on', async () => {
  const viewer = await openPage({}, server.address);
  const { page } = viewer;
  const tick = (name: string) => page.getByRole('group', { name: 'Files' }).getByLabel(name);
  await viewer.open(`#floor=${new PlanFiles(server.folder).ground.id}&layer=plain`);
  await expect
    .poll(() => page.getByRole('group', { name: 'Files' }).locator('label').allTextContents())
    .toEqual(['walls.ifc', 'rest.ifc']);
  await page.keyboard.press('t');
  await viewer.settle();
  const all = await viewer.canvasPixels();
  expect((await clicked(viewer)).filter((name) => name.endsWith('(walls.ifc)')).length).toBeGreaterThan(0);

  await tick('walls.ifc').uncheck();
  await viewer.settle();
  const withoutWalls = await viewer.canvasPixels();
  expect(all.shareChanged(withoutWalls)).toBeGreaterThan(0.02);
  const left = await clicked(viewer);
  expect(left.length).toBeGreaterThan(0);
  expect(left.filter((name) => !name.endsWith('(rest.ifc)'))).toEqual([]);
  await viewer.screenshot('f-without-walls');
  await expect.poll(() => viewer.hash()).toContain('without=0');

  // The address has it, so others see the same.
  const theirs = await openPage({}, server.address);
  await theirs.open(await viewer.hash());
  await expect
    .poll(() => theirs.page.getByRole('group', { name: 'Files' }).getByLabel('walls.ifc').isChecked())
    .toBe(false);
  await theirs.page.close();

  await page.getByRole('tab', { name: 'Unseen' }).click();
  await page.getByRole('list', { name: 'Unseen surfaces' }).getByText('(walls.ifc)').first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isPurple)).toBeGreaterThan(0.002);
  await page.getByRole('tab', { name: 'Plan', exact: true }).click();
  await expect.poll(() => tick('walls.ifc').isChecked()).toBe(true);
  // Hidden again, its mark is hidden with it.
  await tick('walls.ifc').uncheck();
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isPurple)).toBeLessThan(0.0005);
  await viewer.screenshot('f-mark-hidden');
});

test('a plan of one file has no list of files', async () => {
  const one = await openPage();
  await one.open();
  await expect.poll(() => one.page.locator('[data-floor]').count()).toBeGreaterThan(1);
  await expect.poll(() => one.page.getByRole('group', { name: 'Files' }).count()).toBe(0);
});
