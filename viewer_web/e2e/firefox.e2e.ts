/** A witness in Firefox: the page opens, a station is picked, and an edit is kept. */
import { expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { centreOf, onFirefoxPage, settle } from './firefox.ts';
import { discardReview, PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const { plan, ground, stationsOf } = new PlanFiles(planFolder);
const [{ id }] = stationsOf(ground.id);

test('in Firefox the plan opens, a station is picked by its number, and its lock is kept', async () => {
  await onFirefoxPage(`${inject('address')}#floor=${ground.id}&tab=edit`, async (page) => {
    await page.waitForSelector('[data-testid=totals]');
    const coverage = `${(100 * plan.coverage.fraction_of_achievable).toFixed(1)} %`;
    await expect.poll(() => page.$eval('[data-testid=totals]', (totals) => totals.textContent)).toContain(coverage);
    const { x, y } = await centreOf(page, id);
    await page.mouse.click(x, y);
    await page.locator('::-p-aria([name="Lock"][role="button"])').click();
    const review = (): Promise<Review> => page.evaluate(async () => (await fetch('api/review')).json());
    await expect.poll(async () => (await review()).stations[id]?.locked).toBe(true);
    await settle(page);
  });
  discardReview(planFolder);
});
