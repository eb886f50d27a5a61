/** WCAG 2.2 AA by axe: every tab, the cards and dialogs, the field views, also at 200 % zoom and in the dark. */
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import type { Page } from 'playwright-core';
import { afterEach, expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { TABS } from '../src/panels/tabs.tsx';
import { type Look, ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles } from './plan-files.ts';

const AXE = readFileSync(fileURLToPath(new URL('../node_modules/axe-core/axe.min.js', import.meta.url)), 'utf8');
const STANDARDS = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'];
const { plan } = new PlanFiles(inject('planFolder'));
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const [first, second] = plan.stations.filter(({ floor: id }) => id === floor.id);

const own = ownCopy(inject('planFolder'));
let viewer: ViewerPage;
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults.filter((fault) => !/409|ERR_FAILED/.test(fault))).toEqual([]);
});

async function open(hash: string, look: Look = {}): Promise<Page> {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 1280, height: 800, ...look });
  await viewer.open(hash);
  return viewer.page;
}

/** What axe objects to, one line each: the rule, and the elements. */
async function violations(page: Page): Promise<string[]> {
  // Not as a script of the page: its policy allows none but its own.
  await page.evaluate(AXE);
  return page.evaluate(async (values) => {
    const { axe } = window as unknown as { axe: typeof import('axe-core') };
    const found = await axe.run(document, { runOnly: { type: 'tag', values } });
    return found.violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(' ')).join(', ')}`);
  }, STANDARDS);
}

const LOOKS: readonly (readonly [string, Look])[] = [
  ['a desk', {}],
  ['a desk at 200 %', { width: 640, height: 400 }],
  ['a desk in the dark', { colorScheme: 'dark' }],
];

test.each(LOOKS)('no tab breaks a rule on %s', async (_, look) => {
  const page = await open(`#floor=${floor.id}`, look);
  const found: Record<string, string[]> = {};
  for (const { id, title } of TABS) {
    await page.getByRole('tab', { name: title }).click();
    await viewer.settle();
    const broken = await violations(page);
    if (broken.length > 0) found[id] = broken;
  }
  expect(found).toEqual({});
});

test.each(LOOKS)('no card and no dialog breaks a rule on %s', async (_, look) => {
  const page = await open(`#floor=${floor.id}`, look);
  const found: Record<string, string[]> = {};
  const look_ = async (name: string): Promise<void> => {
    await viewer.settle();
    const broken = await violations(page);
    if (broken.length > 0) found[name] = broken;
  };
  await page.locator(`.marker[data-station="${first.id}"]`).focus();
  await page.keyboard.press('Enter');
  await look_('station card');
  await page.getByRole('button', { name: 'Panorama' }).click();
  await page.locator('.panorama canvas').waitFor();
  await look_('panorama');
  await page.keyboard.press('Escape');
  await page.locator('canvas').first().focus();
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Space');
  await look_('surface card');
  await page.getByRole('tab', { name: 'Network' }).click();
  await page.getByRole('button', { name: 'Enlarge' }).first().click();
  await look_('enlarged graph');
  await page.keyboard.press('Escape');
  await conflict(page);
  await look_('conflict');
  await page.getByRole('button', { name: 'Keep theirs' }).click();
  expect(found).toEqual({});
});

/** Somebody's change that this page does not hear of, and its own of the same station. */
async function conflict(page: Page): Promise<void> {
  await page.route('**/api/events', (route) => route.abort());
  await page.reload();
  await page.getByTestId('trouble').waitFor();
  const review: Review = await page.evaluate(async () => (await fetch('api/review')).json());
  const kind = review.verdicts[second.id] === undefined ? 'set_verdict' : 'clear_verdict';
  const change = { kind, station: second.id, ...(kind === 'set_verdict' ? { verdict: 'accepted', note: '' } : {}) };
  const body = JSON.stringify({ base_revision: review.revision, author: 'Ben', changes: [change] });
  await page.evaluate(
    (text) =>
      fetch('api/review/changes', { method: 'POST', headers: { 'content-type': 'application/json' }, body: text }),
    body,
  );
  await page.getByRole('tab', { name: 'Review' }).click();
  await page.getByRole('button', { name: `Reject ${second.id}`, exact: true }).click();
  await page.getByRole('alertdialog').waitFor();
  viewer.faults.splice(0);
}

test.each([
  ['a tablet', { width: 768, height: 1024 }],
  ['a phone', { width: 390, height: 844 }],
] as const)('the field view breaks no rule on %s', async (_, look) => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { ...look, hasTouch: true });
  await viewer.page.goto(`${own.server.address}#view=field`);
  await viewer.page.getByTestId('field-count').waitFor();
  expect(await violations(viewer.page)).toEqual([]);
});

test('keys of one character are switched off, and stay so', async () => {
  const page = await open(`#floor=${floor.id}`);
  const shown = (): Promise<string> => page.getByLabel('Shown floor').inputValue();
  const choice = page.getByLabel('Keys of one character');
  await choice.uncheck();
  await page.reload();
  await viewer.settle();
  expect(await choice.isChecked()).toBe(false);
  await choice.blur();
  await page.keyboard.press('0');
  expect(await shown()).toBe(floor.id);
  await page.keyboard.press('Escape');
  await expect.poll(shown).toBe('');
  await choice.check();
  await choice.blur();
  await page.keyboard.press(`${plan.floors.findIndex(({ id }) => id === floor.id) + 1}`);
  await expect.poll(shown).not.toBe('');
});
