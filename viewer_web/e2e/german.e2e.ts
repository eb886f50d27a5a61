/** The language of the viewer, chosen on the page. */
import { expect, test } from 'vitest';
import { viewerPages } from './browser.ts';

const openPage = viewerPages({ width: 1024, height: 768 });

test('a language that was chosen is kept, with what is shown', async () => {
  const viewer = await openPage();
  await viewer.open('#tab=network');
  const { page } = viewer;
  await page.getByRole('combobox', { name: 'Language' }).selectOption('de');
  await page.getByRole('tab', { name: 'Netz', selected: true }).waitFor();
  await viewer.open();
  await expect.poll(() => page.getByRole('tab').last().textContent()).toBe('Prüfung');
  await page.getByRole('combobox', { name: 'Sprache' }).selectOption('en');
  await page.getByRole('tab', { name: 'Network' }).waitFor();
  await expect.poll(() => page.locator('html').getAttribute('lang')).toBe('en');
});
