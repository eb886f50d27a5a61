/** More of the viewer in Firefox: the picture, a station's cloud, and a station dragged and kept. */
import { expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { centreOf, onFirefoxPage, settle } from './firefox.ts';
import { discardReview, PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const { plan, ground, stationsOf } = new PlanFiles(planFolder);
const [{ id }] = stationsOf(ground.id);

test("in Firefox the building and a station's cloud are drawn, and a dragged station is kept", async () => {
  const address = inject('address');
  await onFirefoxPage(address, async (page) => {
    expect((await page.$$('li [data-station]')).length).toBe(plan.stations.length);
    const png = await page.screenshot({ encoding: 'base64', clip: { x: 350, y: 160, width: 600, height: 340 } });
    const drawn = await page.evaluate(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const paper = new OffscreenCanvas(image.width, image.height).getContext('2d')!;
      paper.drawImage(image, 0, 0);
      const { data } = paper.getImageData(0, 0, image.width, image.height);
      const corner = data.length - 4;
      let n = 0;
      for (let i = 0; i < data.length; i += 4) {
        if ([0, 1, 2].some((k) => Math.abs(data[i + k] - data[corner + k]) > 8)) n++;
      }
      return n / (data.length / 4);
    }, png);
    expect(drawn).toBeGreaterThan(0.15);
    expect(drawn).toBeLessThan(0.95);
    await page.goto(`${address}#floor=${ground.id}&station=${id}`);
    await page.waitForSelector('[data-testid=cloud][data-state=shown]');

    await page.goto(`${address}#floor=${ground.id}&tab=edit`);
    await page.waitForSelector('[data-testid=totals]');
    await page.keyboard.press('t');
    await settle(page);
    const review = (): Promise<Review> => page.evaluate(async () => (await fetch('api/review')).json());
    const { revision } = await review();
    const { x, y } = await centreOf(page, id);
    await page.mouse.move(x, y);
    await page.mouse.down();
    for (let i = 1; i <= 6; i++) {
      await page.mouse.move(x + 10 * i, y + 6 * i);
      await settle(page);
    }
    await page.mouse.up();
    await expect.poll(async () => (await review()).revision).not.toBe(revision);
    const after = await centreOf(page, id);
    expect(Math.hypot(after.x - x, after.y - y)).toBeGreaterThan(20);
  });
  discardReview(planFolder);
});
