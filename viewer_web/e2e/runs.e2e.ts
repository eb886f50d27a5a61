/** Planning again from a real browser: the form, a run's progress, its plan opened, compared and deleted. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Locator } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test, vi } from 'vitest';
import type { Run } from '../src/api/documents.ts';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles } from './plan-files.ts';

// A run is a real one: it loads the scene, scans and chooses, on a machine that may be busy.
vi.setConfig({ testTimeout: 1_500_000, hookTimeout: 600_000 });
const RUN_MS = 540_000;

const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);

const own = ownCopy(planFolder);
let viewer: ViewerPage;
let held: number | null = null;
beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 900, height: 700 });
  await viewer.open('#tab=runs');
});
afterEach(async () => {
  goOn();
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

const runs = (): Promise<Run[]> => viewer.page.evaluate(async () => (await (await fetch('api/runs')).json()).runs);
const card = (id: string): Locator => viewer.page.locator(`[data-run="${id}"]`);

/** Stop a run's process as soon as it tells of stations: on a busy machine it might end before they are looked at. */
async function holdAtItsBest(id: string): Promise<void> {
  const folder = join(own.server.folder, 'runs');
  const told = (file: string) => JSON.parse(readFileSync(join(folder, file), 'utf8'));
  await expect.poll(() => told(`${id}/run.json`).best, { timeout: RUN_MS, interval: 20 }).not.toBeNull();
  const { run, pid } = told('.turn') as { run: string; pid: number };
  expect(run).toBe(id);
  process.kill(pid, 'SIGSTOP');
  held = pid;
}
function goOn(): void {
  if (held !== null) process.kill(held, 'SIGCONT');
  held = null;
}

test('a form that makes no sense is told so before anything starts', async () => {
  const coverage = viewer.page.getByRole('textbox', { name: /^Coverage/ });
  expect(await coverage.inputValue()).toBe(String(100 * plan.requirements.coverage));
  await coverage.fill('120');
  await viewer.page.getByText('Coverage: 1 to 100 %').waitFor();
  expect(await viewer.page.getByRole('button', { name: 'Start' }).isDisabled()).toBe(true);
});

test('a run is started, watched, opened, compared and deleted', { tags: 'main' }, async () => {
  const { page } = viewer;
  await page.getByRole('tab', { name: 'Edit' }).click();
  await page.locator(`.marker[data-station="${plan.stations[0].id}"]`).click();
  await page.getByRole('button', { name: 'Lock', exact: true }).click();
  const undo = page.getByRole('button', { name: /^Undo: lock/ });
  await undo.waitFor();
  await page.getByRole('tab', { name: 'Runs' }).click();
  await page.getByRole('textbox', { name: 'Title' }).fill('Ground floor, seven stations');
  await page.getByRole('combobox', { name: 'Objective' }).selectOption('coverage');
  await page.getByRole('textbox', { name: /^Stations/ }).fill('7');
  await page.getByText('More requirements').click();
  await page.getByRole('checkbox', { name: 'Upper floor' }).uncheck();
  await page.getByRole('textbox', { name: /^Time limit/ }).fill('5');
  await page.getByRole('button', { name: 'Start' }).click();
  await expect.poll(() => page.locator('[data-run]').count()).toBe(1);
  const [{ id }] = await runs();
  await holdAtItsBest(id);
  // Its best stations so far take the place of the plan's, and that is told.
  const banner = page.getByRole('status', { name: 'Shown stations' });
  await banner.getByText(`Showing the best stations of run ${id} so far`).waitFor();
  expect(await page.locator('.marker').count()).toBe(7);
  expect(await page.getByLabel('Chosen station').count()).toBe(0);
  await page.getByText('More requirements').click();
  await card(id).scrollIntoViewIfNeeded();
  await viewer.settle();
  await viewer.screenshot('runs-1-running');
  await banner.getByRole('button', { name: 'Back to the plan' }).click();
  expect(await page.locator('.marker').count()).toBe(plan.stations.length);
  await page.getByLabel('Chosen station').waitFor();
  await banner.getByRole('button', { name: 'Watch the run' }).click();
  expect(await page.locator('.marker').count()).toBe(7);
  goOn();
  await expect.poll(() => card(id).getAttribute('data-state'), { timeout: RUN_MS }).toBe('finished');
  expect(await card(id).getByTestId('run-best').textContent()).toMatch(/\d+ stations?/);
  await viewer.screenshot('runs-2-finished');
  expect(await banner.count()).toBe(0);

  await card(id).getByRole('button', { name: 'Compare' }).click();
  await page.getByTestId('comparison').waitFor();
  await expect.poll(() => page.locator('.legend').textContent()).toContain(`seen only in Run ${id}`);
  await viewer.screenshot('runs-3-compared');

  // Another plan is another page: until it is there, this one's markers stay.
  const opened = page.waitForEvent('load');
  await card(id).getByRole('link', { name: 'Open' }).click();
  await opened;
  expect(await viewer.hash()).toContain('plan=runs');
  await page.locator('.marker:not([hidden])').first().waitFor();
  const [run] = await runs();
  expect(await page.locator('.marker').count()).toBe(run.best?.n_stations);
  await page.getByRole('tab', { name: 'Edit' }).click();
  await page.getByText('This is the plan of a run').waitFor();
  await banner.getByText(`Showing run ${id}, Ground floor, seven stations: 7 stations`).waitFor();
  await page.getByRole('tab', { name: 'Runs' }).click();
  await viewer.screenshot('runs-4-opened');
  const back = page.waitForEvent('load');
  await banner.getByRole('link', { name: 'Back to the plan' }).click();
  await back;
  await expect.poll(() => page.locator('.marker').count()).toBe(plan.stations.length);
  await page.getByRole('tab', { name: 'Edit' }).click();
  await undo.click();
  await undo.waitFor({ state: 'detached' });
  await page.getByRole('tab', { name: 'Runs' }).click();
  await card(id).getByRole('button', { name: 'Delete' }).click();
  await card(id).getByRole('button', { name: 'Really delete?' }).click();
  await expect.poll(() => page.locator('[data-run]').count()).toBe(0);
});

test('a run that is cancelled says how it ended', async () => {
  const { page } = viewer;
  await page.getByRole('textbox', { name: 'Title' }).fill('Never mind');
  await page.getByRole('button', { name: 'Start' }).click();
  await expect.poll(() => page.locator('[data-run]').count()).toBe(1);
  const [{ id }] = await runs();
  expect(await page.getByRole('button', { name: 'Start' }).isDisabled()).toBe(true);
  await card(id).getByRole('button', { name: 'Cancel' }).click();
  await expect.poll(() => card(id).getAttribute('data-state'), { timeout: RUN_MS }).toBe('cancelled');
  // As another page would: this one is told.
  // While its process still leaves, the server refuses: on a busy machine that takes a while.
  const remove = (run: string): Promise<boolean> => fetch(`api/runs/${run}`, { method: 'DELETE' }).then(({ ok }) => ok);
  await expect.poll(() => page.evaluate(remove, id)).toBe(true);
  await expect.poll(() => page.locator('[data-run]').count()).toBe(0);
});
