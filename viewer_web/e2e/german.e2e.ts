/** The viewer in German, on the narrowest screen that it is laid out for: chosen, kept, and without texts that are cut off. */
import { afterEach, expect, inject, test } from 'vitest';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';

const NARROW = { width: 1024, height: 768 };
const TITLES = ['Plan', 'Lücken', 'Netz', 'Ändern', 'Läufe', 'Prüfung'];

const own = ownCopy(inject('planFolder'));
let viewer: ViewerPage;
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

/** Texts that reach out of what shows them, or of the page. */
function cutOff(): Promise<string[]> {
  return viewer.page.evaluate(() => {
    const hasWords = (element: Element): boolean =>
      [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && /\S/.test(node.textContent ?? ''));
    /** Names of the plan's things may end in dots. */
    const mayEnd = (element: Element): boolean => element.closest('.row-name, .row-place, .brand, .own li') !== null;
    const isCut = (element: Element): boolean => {
      if (!hasWords(element) || element.closest('.markers, svg, select, .row-name') !== null) return false;
      const box = element.getBoundingClientRect();
      if (box.width === 0 || getComputedStyle(element).visibility === 'hidden') return false;
      const frame = element.closest('.sidebar')?.getBoundingClientRect() ?? { left: 0, right: window.innerWidth };
      const isOut = box.right > frame.right + 1 || box.left < frame.left - 1;
      return isOut || (element.scrollWidth > element.clientWidth + 1 && element.clientWidth > 0 && !mayEnd(element));
    };
    const wide = document.documentElement.scrollWidth > window.innerWidth ? ['the page'] : [];
    return [
      ...wide,
      ...[...document.body.querySelectorAll('*')].filter(isCut).map((one) => `${one.className}: ${one.textContent}`),
    ];
  });
}

test('in German every tab is German, and nothing is cut off at 1024 x 768', { tags: 'main' }, async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { ...NARROW, locale: 'de-DE' });
  await viewer.open();
  const { page } = viewer;
  expect(await page.locator('html').getAttribute('lang')).toBe('de');
  expect(await page.getByRole('tab').allTextContents()).toEqual(TITLES);
  expect(await page.getByTestId('coverage').textContent()).toMatch(/^\d+,\d %$/);
  const found: Record<string, string[]> = {};
  for (const title of TITLES) {
    await page.getByRole('tab', { name: title, exact: true }).click();
    await viewer.settle();
    await viewer.screenshot(`german-${TITLES.indexOf(title)}`);
    const cut = await cutOff();
    if (cut.length > 0) found[title] = cut;
  }
  expect(found).toEqual({});
});

test('a language that was chosen is kept, with what is shown', async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, NARROW);
  await viewer.open('#tab=network');
  const { page } = viewer;
  await page.getByRole('combobox', { name: 'Language' }).selectOption('de');
  await page.getByRole('tab', { name: 'Netz', selected: true }).waitFor();
  await viewer.open();
  expect(await page.getByRole('tab').allTextContents()).toEqual(TITLES);
  await page.getByRole('combobox', { name: 'Sprache' }).selectOption('en');
  await page.getByRole('tab', { name: 'Network' }).waitFor();
  expect(await page.locator('html').getAttribute('lang')).toBe('en');
});
