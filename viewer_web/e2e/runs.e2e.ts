/** Planning again from a real browser: a form that makes no sense, and a run that is cancelled. */
import { expect, inject, test } from 'vitest';
import type { Run } from '../src/api/documents.ts';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan } = new PlanFiles(inject('planFolder'));
const openPage = viewerPages({ width: 960, height: 600 });

test('a form that makes no sense is refused before a run starts, and a cancelled run is shown as such', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#tab=runs');
  const coverage = page.getByRole('textbox', { name: /^Coverage/ });
  const start = page.getByRole('button', { name: 'Start' });
  const required = String(100 * plan.requirements.coverage);
  await expect.poll(() => coverage.inputValue()).toBe(required);
  await coverage.fill('120');
  await page.getByText('Coverage: 1 to 100 %').waitFor();
  await expect.poll(() => start.isDisabled()).toBe(true);
  await coverage.fill(required);
  await page.getByRole('textbox', { name: 'Title' }).fill('Never mind');
  await start.click();
  const card = page.locator('[data-run]');
  await expect.poll(() => card.count()).toBe(1);
  const { runs } = (await page.evaluate(async () => (await fetch('api/runs')).json())) as { runs: Run[] };
  await expect.poll(() => start.isDisabled()).toBe(true);
  await card.getByRole('button', { name: 'Cancel' }).click();
  await expect.poll(() => card.getAttribute('data-state')).toBe('cancelled');
  // Deleted as by another page, of which this one gets an event. The server refuses it until the run's process has ended.
  const remove = (run: string): Promise<boolean> => fetch(`api/runs/${run}`, { method: 'DELETE' }).then(({ ok }) => ok);
  await expect.poll(() => page.evaluate(remove, runs[0].id)).toBe(true);
  await expect.poll(() => card.count()).toBe(0);
  // The browser itself notes each refusal.
  expect(viewer.faults.splice(0).filter((fault) => !/409/.test(fault))).toEqual([]);
});
