/** The review of overlap in a real browser, against the figures and files of the plan. */
import { expect, inject, test } from 'vitest';
import { countingOf, networkOf } from '../src/network/graph.ts';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan } = new PlanFiles(inject('planFolder'));
const { registration } = plan;
const ids = plan.stations.map(({ id }) => id);
const report = networkOf(ids, registration.links, countingOf(plan));

const openPage = viewerPages({ width: 1280, height: 800 });
test('what the browser finds of the network is what the planner found', () => {
  const sorted = (lists: readonly (readonly string[])[]): string[] => lists.map((list) => list.join(' ')).sort();
  expect(sorted(report.components)).toEqual(sorted(registration.networks.map(({ stations }) => stations)));
  expect(sorted([...report.bridges].map(({ a, b }) => [a, b]))).toEqual(
    sorted(registration.networks.flatMap(({ bridges }) => bridges)),
  );
  expect([...report.articulations].sort()).toEqual(registration.networks.flatMap((one) => one.articulations).sort());
});

test('links are drawn and listed by what they are worth, each with its weakest direction, and a pair by what it shares', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open();
  const without = await viewer.canvasPixels();
  await page.getByRole('tab', { name: 'Network' }).click();
  await viewer.settle();
  expect(without.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.0005);
  const register = page.getByRole('list', { name: 'Registration links' }).locator('.row-link');
  const tooWeak = page.getByRole('list', { name: 'Weak links' }).locator('.row-link');
  const nCounting = report.counting.length - report.bridges.size;
  await expect.poll(() => register.count()).toBe(Math.min(nCounting, 40));
  for (const words of await register.locator('.link-words').allTextContents()) {
    expect(words).toMatch(/^weakest direction: (shift|tilt about|turn) ?(N|E|NE|NW|up|\(|on|about)/);
  }
  const nWeak = registration.links.length - report.counting.length - report.gaps.length;
  await expect.poll(() => tooWeak.count()).toBe(Math.min(nWeak, 10));
  await expect
    .poll(() => tooWeak.first().locator('.link-words').textContent())
    .toMatch(/^(overlap|strength|probability) below /);
  // Nothing of it is cut off.
  const isCut = await page
    .locator('.link-words')
    .evaluateAll((all) => all.some((one) => one.scrollWidth > one.clientWidth + 1));
  expect(isCut).toBe(false);
  await register.first().scrollIntoViewIfNeeded();
  await viewer.screenshot('n-links');
  const link = [...registration.links].sort((x, y) => y.overlap - x.overlap)[0];
  await page
    .locator('.row-link')
    .filter({ hasText: `${link.a} – ${link.b}` })
    .first()
    .click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  const shown = await viewer.figures('pair-figures');
  expect(shown.Overlap).toBe(overlapWords(link.overlap));
  const most = (100 * Math.min(link.probability ?? 0, 0.999)).toFixed(1);
  expect(shown.Probability).toBe(`${most} %`);
  const covered = [link.a, link.b].map((id) => plan.stations.find((one) => one.id === id)!.covered_area_m2);
  // Overlap is the smaller of both shares: what is shared over what the one sees that sees more.
  const shared = link.overlap * Math.max(...covered);
  expect(Math.abs(Number(shown['Shared surface'].replace(' m²', '')) - shared)).toBeLessThan(0.1 + 0.05 * shared);
  const purple = (await viewer.canvasPixels()).share(([r, g, b]) => b > g + 40 && r > g + 25);
  expect(purple).toBeGreaterThan(0.01);
  expect(new URLSearchParams(new URL(page.url()).hash.slice(1)).getAll('pair')).toEqual([link.a, link.b]);
  await viewer.screenshot('n-pair');
});

test('the matrix is read and chosen from by pointer and keys; enlarged it has figures that fit their cells', async () => {
  const viewer = await openPage({ colorScheme: 'dark' });
  const { page } = viewer;
  await viewer.open('#tab=network');
  await page.getByRole('radio', { name: 'Matrix' }).click();
  await expect.poll(() => page.locator('.matrix-figure').count()).toBe(0);
  const small = page.getByRole('application');
  const rim = await small.boundingBox();
  await page.mouse.move(rim!.x + 0.6 * rim!.width, rim!.y + 0.55 * rim!.height);
  await small.locator('.matrix-number-pointed').first().waitFor();
  const boxes = await small.locator('.matrix-number').evaluateAll((all) =>
    all.map((one) => {
      const { left, right, top, bottom } = one.getBoundingClientRect();
      return { left, right, top, bottom };
    }),
  );
  const covers = boxes.filter((a, i) =>
    boxes.some(
      // A pixel of what surrounds the figures does not count.
      (b, j) =>
        i < j && a.left < b.right - 1.5 && b.left < a.right - 1.5 && a.top < b.bottom - 1.5 && b.top < a.bottom - 1.5,
    ),
  );
  expect(covers).toEqual([]);
  await viewer.screenshot('n-matrix-small');
  await page.getByRole('button', { name: 'Enlarge' }).click();
  const sheet = page.locator('.sheet');
  const matrix = page.locator('.sheet').getByRole('application');
  const words = page.locator('.sheet .matrix-words');
  const link = registration.links[0];
  const [row, column] = [link.a, link.b].map((id) => ids.indexOf(id));
  // The sheet takes the focus when it opens.
  await page.waitForFunction(() => document.activeElement?.getAttribute('aria-label') === 'Close');
  await matrix.focus();
  for (let i = 0; i < row; i++) await page.keyboard.press('ArrowDown');
  for (let i = 0; i < column; i++) await page.keyboard.press('ArrowRight');
  await expect
    .poll(() => words.textContent())
    .toContain(`${link.a} – ${link.b}: ${overlapWords(link.overlap)} overlap`);
  await viewer.screenshot('n-matrix');
  const figures = sheet.locator('.matrix-figure');
  await figures.first().waitFor();
  const withStrength = registration.links.filter(({ strength }) => strength !== null);
  await expect.poll(() => figures.count()).toBe(registration.links.length + withStrength.length);
  const texts = await figures.allTextContents();
  const least = 100 * registration.threshold;
  const overlaps = registration.links.map(({ overlap }) =>
    100 * overlap < least && Math.round(100 * overlap) >= least ? `<${least}` : (100 * overlap).toFixed(0),
  );
  expect(texts.filter((words) => !words.includes('.')).sort()).toEqual(overlaps.sort());
  const cell = await sheet.locator('.matrix-diagonal').first().boundingBox();
  const widths = await figures.evaluateAll((all) => all.map((one) => one.getBoundingClientRect().width));
  expect(Math.max(...widths)).toBeLessThan(cell!.width);
  await expect.poll(() => sheet.getByTestId('overlap-legend').textContent()).toMatch(/0 %.*100 %/);
  await viewer.screenshot('n-matrix-figures');
  await sheet.getByRole('checkbox', { name: /^Figures/ }).click();
  await expect.poll(() => figures.count()).toBe(0);
  await matrix.focus();
  await page.keyboard.press('Enter');
  await expect.poll(() => page.getByRole('heading', { name: `${link.a} – ${link.b}` }).count()).toBe(1);
  await page.locator('.sheet').getByRole('button', { name: 'Close' }).click();
  await viewer.settle();
  await viewer.screenshot('n-pair-dark');
});

/** As the sheets write it. */
function overlapWords(overlap: number): string {
  const { threshold } = registration;
  const words = (100 * overlap).toFixed(1);
  return `${overlap < threshold && Number(words) >= 100 * threshold ? `just below ${100 * threshold}` : words} %`;
}
