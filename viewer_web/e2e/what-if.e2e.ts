/** A station on its way in a real browser: what the card promises is what the move brings, and the building shows it. */
import { expect, inject, test } from 'vitest';
import { countingOf, counts } from '../src/network/graph.ts';
import { type Rgb, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground, stationsOf } = new PlanFiles(inject('planFolder'));
const openPage = viewerPages({ width: 1280, height: 800 });

const isLost = ([r, g, b]: Rgb): boolean => r > 150 && g < 60 && b < 80;
const isWon = ([r, g, b]: Rgb): boolean => g > 180 && g > r + 80 && g > b + 70;
const areaIn = (text: string): number => Number(/([\d.]+) m²/.exec(text)![1]);

test('while a station is dragged, a card has what it adds and loses, the building paints it, and the move brings it', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.openEditing(`floor=${ground.id}`, 'p');
  const before = await viewer.canvasPixels();
  expect(before.share(isLost)).toBe(0);
  const station = stationsOf(ground.id)[0];
  const from = await viewer.centreOf(station.id);
  await viewer.dragFrom(from, -70, 60);
  const card = page.getByTestId('what-if');
  await expect.poll(() => card.textContent()).toMatch(/Adds\+.*Loses−/);
  await viewer.settle();
  const during = await viewer.canvasPixels();
  expect(during.share(isLost) + during.share(isWon)).toBeGreaterThan(0.0005);
  await viewer.screenshot('what-if');
  const { revision } = await viewer.review();
  await page.mouse.up();
  await viewer.changedFrom(revision);
  await expect.poll(() => card.count()).toBe(0);
  const after = await viewer.canvasPixels();
  expect(after.share(isLost)).toBe(0);

  // Back and there again by the very place: what the card has then is compared with the figures of both plans.
  const figuresNow = () => page.evaluate(async () => (await fetch('api/live/figures')).json());
  const moved = await figuresNow();
  await viewer.undo();
  await page.mouse.move(...(await viewer.centreOf(station.id)));
  await viewer.dragFrom(await viewer.centreOf(station.id), -70, 60);
  await expect.poll(() => card.textContent()).toMatch(/Adds\+.*Loses−/);
  await viewer.settle();
  const shown = await viewer.figures('what-if');
  const gainM2 = areaIn(shown.Adds) - areaIn(shown.Loses);
  // Both figures are rounded to tenths.
  const gainedM2 = moved.coverage.covered_area_m2 - plan.coverage.covered_area_m2;
  expect(Math.abs(gainM2 - gainedM2)).toBeLessThan(0.11);
  const counting = countingOf(plan);
  const ends = (links: readonly (typeof plan.registration.links)[number][]) =>
    links
      .filter((link) => (link.a === station.id || link.b === station.id) && counts(link, counting))
      .map(({ a, b }) => (a === station.id ? b : a));
  const [was, now] = [ends(plan.registration.links), ends(moved.registration.links)];
  expect(shown['Links lost']).toBe(was.filter((id) => !now.includes(id)).join(' ') || 'none');
  expect(shown['Links won']).toBe(now.filter((id) => !was.includes(id)).join(' ') || 'none');
  await page.keyboard.press('Escape');
  await expect.poll(() => card.count()).toBe(0);
  await page.mouse.up();
});
