/** WCAG 2.2 AA by axe: every tab, the cards and dialogs, the field views, also at 200 % zoom and in the dark. */
import { expect, inject, test } from 'vitest';
import { TABS } from '../src/panels/tabs.tsx';
import { violations } from './axe.ts';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const [first, second] = stationsOf(floor.id);
const openPage = viewerPages({ width: 1280, height: 800 });

test.each([
  ['a desk', {}],
  ['a dark desk at 200 %', { width: 640, height: 400, colorScheme: 'dark' }],
] as const)('no tab, card or dialog breaks a rule on %s', async (_, look) => {
  const viewer = await openPage(look);
  const { page } = viewer;
  await viewer.open(`#floor=${floor.id}`);
  const found: Record<string, string[]> = {};
  const check = async (name: string): Promise<void> => {
    await viewer.settle();
    found[name] = await violations(page);
  };
  for (const { title } of TABS) {
    await page.getByRole('tab', { name: title }).click();
    await check(title);
  }
  await page.getByRole('tab', { name: 'Plan' }).click();
  await viewer.marker(first.id).focus();
  await page.keyboard.press('Enter');
  await check('station card');
  await page.getByRole('button', { name: 'Panorama' }).click();
  await page.locator('.panorama canvas').waitFor();
  await check('panorama');
  await page.getByRole('radio', { name: 'Look around' }).click();
  await page.locator('.look-around canvas').waitFor();
  await check('looking around');
  await page.keyboard.press('Escape');
  await page.locator('canvas').first().focus();
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Space');
  await check('surface card');
  await page.getByRole('tab', { name: 'Network' }).click();
  await page.getByRole('button', { name: 'Enlarge' }).first().click();
  await check('enlarged graph');
  await page.keyboard.press('Escape');
  await conflict(viewer);
  await check('conflict');
  expect(found).toEqual(Object.fromEntries(Object.keys(found).map((name) => [name, []])));
  expect(viewer.faults.splice(0).filter((fault) => !/409|ERR_FAILED/.test(fault))).toEqual([]);
});

/** Someone else's change, of which this page gets no event, and its own of the same station. */
async function conflict(viewer: ViewerPage): Promise<void> {
  const { page } = viewer;
  await page.route('**/api/events*', (route) => route.abort());
  await page.reload();
  await page.getByTestId('trouble').waitFor();
  await viewer.changeAs('Ben', { kind: 'set_verdict', station: second.id, verdict: 'accepted' });
  await page.getByRole('tab', { name: 'Review' }).click();
  await page.getByRole('button', { name: `Reject ${second.id}`, exact: true }).click();
  await page.getByRole('alertdialog').waitFor();
}

test.each([
  ['a tablet', { width: 768, height: 1024 }],
  ['a phone', { width: 390, height: 844 }],
] as const)('the field view breaks no rule on %s', async (_, look) => {
  const viewer = await openPage({ ...look, hasTouch: true });
  await viewer.page.goto(`${inject('address')}#view=field`);
  await viewer.page.getByTestId('field-count').waitFor();
  expect(await violations(viewer.page)).toEqual([]);
});

test('keys of one character are switched off, and stay switched off', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open(`#floor=${floor.id}`);
  const shown = (): Promise<string> => page.getByLabel('Shown floor').inputValue();
  const choice = page.getByLabel('Keys of one character');
  await choice.uncheck();
  await page.reload();
  await viewer.settle();
  await expect.poll(() => choice.isChecked()).toBe(false);
  await choice.blur();
  await page.keyboard.press('0');
  await expect.poll(shown).toBe(floor.id);
  await page.keyboard.press('Escape');
  await expect.poll(shown).toBe('');
  await choice.check();
  await choice.blur();
  await page.keyboard.press(`${plan.floors.findIndex(({ id }) => id === floor.id) + 1}`);
  await expect.poll(shown).not.toBe('');
});

test('the toolbar is one stop for Tab, arrows go through it, and its tips name keys', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open();
  const focused = () =>
    page.evaluate(() => document.activeElement?.id || document.activeElement?.getAttribute('aria-label'));
  await page.locator('#tool-panel').focus();
  await page.keyboard.press('ArrowRight');
  await expect.poll(focused).toBe('Shown floor');
  const before = await page.getByLabel('Shown floor').inputValue();
  for (let i = 0; i < 4; i++) await page.keyboard.press('ArrowRight');
  await expect.poll(focused).toBe('tool-walk');
  await expect.poll(() => page.getByLabel('Shown floor').inputValue()).toBe(before);
  await expect.poll(() => page.getByRole('tooltip').textContent()).toMatch(/^Walk: .*W$/);
  await page.keyboard.press('Escape');
  await expect.poll(() => page.getByRole('tooltip').count()).toBe(0);
  await page.keyboard.press('End');
  await expect.poll(focused).toBe('share-menu');
  await page.keyboard.press('Tab');
  await expect.poll(() => page.evaluate(() => document.activeElement?.closest('.toolbar') === null)).toBe(true);
  await page.keyboard.press('Shift+Tab');
  await expect.poll(focused).toBe('share-menu');
});

test('on a phone a group of the toolbar opens above it, and Escape closes that before all else', async () => {
  const viewer = await openPage({ width: 390, height: 844, hasTouch: true });
  const { page } = viewer;
  await viewer.open(`#station=${first.id}`);
  // What is chosen is shown by the picture, not by the list below it.
  await expect.poll(() => page.locator('.workspace').evaluate((one) => one.scrollTop)).toBe(0);
  const tools = page.getByRole('button', { name: 'Tools' });
  const measure = page.getByRole('button', { name: 'Measure', exact: true });
  await tools.tap();
  await measure.waitFor();
  expect(await violations(page)).toEqual([]);
  await viewer.screenshot('toolbar-phone');
  await page.keyboard.press('Escape');
  await expect.poll(() => measure.count()).toBe(0);
  await expect.poll(() => tools.evaluate((one) => one === document.activeElement)).toBe(true);
  await expect.poll(() => viewer.hash()).toContain(`station=${first.id}`);
  await tools.tap();
  await measure.tap();
  await page.getByRole('region', { name: 'Measure' }).waitFor();
  await expect.poll(() => measure.count()).toBe(0);
  await page.getByRole('button', { name: 'View', exact: true }).tap();
  await page.getByLabel('Shown floor').selectOption({ index: 1 });
  await expect.poll(() => viewer.hash()).toContain('floor=');
});
