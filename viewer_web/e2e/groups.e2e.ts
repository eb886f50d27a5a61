/** Groups of stations and proposed ones in a real browser: what a proposal promises is what adding it brings. */
import { expect, inject, test } from 'vitest';
import { removeStation } from '../src/edit/changes.ts';
import { countingOf, networkOf } from '../src/network/graph.ts';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan } = new PlanFiles(inject('planFolder'));
const openPage = viewerPages({ width: 1280, height: 800 });
const ids = plan.stations.map(({ id }) => id);
const { components } = networkOf(ids, plan.registration.links, countingOf(plan));

test('groups are listed with their members, and a station that is proposed joins as many as it promises', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#tab=network');
  const list = page.getByRole('list', { name: 'Groups' });
  await expect.poll(() => list.getByRole('listitem').count()).toBe(components.length);
  expect(components.length).toBeGreaterThan(2);
  for (const [i, members] of components.entries()) {
    await expect.poll(() => list.locator(`[data-group="${i + 1}"]`).textContent()).toContain(members.join(' '));
  }
  const colorOf = (id: string) => viewer.marker(id).evaluate((marker) => getComputedStyle(marker).backgroundColor);
  const [first, last] = [components[0], components[components.length - 1]];
  await expect.poll(() => colorOf(first[1])).toBe(await colorOf(first[0]));
  await expect.poll(() => colorOf(last[0])).not.toBe(await colorOf(first[0]));
  await viewer.screenshot('groups-listed');

  await page.getByRole('button', { name: 'Join groups' }).click();
  await page.locator('.ghost-marker').waitFor();
  const card = page.getByRole('complementary', { name: 'Proposed station' });
  const words = (await card.locator('.ghost-groups').textContent()) ?? '';
  const [, before, after] = (/^\+1 station: (\d+) groups become (\d+)$/.exec(words) ?? []).map(Number);
  expect(before).toBe(components.length);
  expect(after).toBeLessThan(before);
  const joined = await card.getByTestId('ghost-figures').textContent();
  expect(joined).toMatch(/Registers withS\d{3}/);
  await viewer.screenshot('groups-proposed');
  const { revision } = await viewer.review();
  await card.getByRole('button', { name: 'Add this station' }).click();
  await viewer.changedFrom(revision);
  await expect.poll(() => page.locator('.ghost-marker').count()).toBe(0);
  await expect.poll(() => list.getByRole('listitem').count()).toBe(after);
});

test('the best position of an unseen surface stands in the building, and goes with the tab', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#tab=unseen');
  const mendable = plan.why?.unseen_surfaces.filter(({ best_spot }) => best_spot !== null) ?? [];
  expect(mendable.length).toBeGreaterThan(0);
  await page.getByRole('button', { name: /^reachable, left out/ }).click();
  await page.getByRole('list', { name: 'Unseen surfaces' }).getByRole('button').first().click();
  await page.getByRole('button', { name: 'Show it in the building' }).click();
  await page.locator('.ghost-marker').waitFor();
  const card = page.getByRole('complementary', { name: 'Proposed station' });
  await expect.poll(() => card.getByTestId('ghost-figures').textContent()).toMatch(/Adds[\d.]+ m²/);
  await viewer.screenshot('unseen-proposed');
  await page.getByRole('tab', { name: 'Plan' }).click();
  await expect.poll(() => page.locator('.ghost-marker').count()).toBe(0);
});

test('the verdict stands above every tab, whole, and follows the edits', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open();
  const verdict = page.getByTestId('verdict');
  const words = `NOT MET✓ ${(100 * plan.coverage.fraction_of_achievable).toFixed(1)} %✓ 2 of 2 floors! ${components.length} groups`;
  for (const tab of ['Plan', 'Unseen', 'Network', 'Edit', 'Runs', 'Review']) {
    await page.getByRole('tab', { name: tab }).click();
    await expect.poll(() => verdict.textContent()).toBe(words);
    const isWhole = () =>
      verdict.evaluate((line) => line.scrollWidth <= line.clientWidth && line.getBoundingClientRect().height >= 20);
    await expect.poll(isWhole).toBe(true);
  }
  await page.getByRole('tab', { name: 'Plan' }).click();
  await page.getByRole('list', { name: 'Stations' }).getByRole('button').last().scrollIntoViewIfNeeded();
  await expect.poll(async () => (await verdict.boundingBox())!.y).toBeLessThan(5);
  const [alone] = components[components.length - 1];
  expect(await viewer.changeAs('Somebody', removeStation(alone))).toBe(200);
  await expect.poll(() => verdict.textContent()).toContain(`! ${components.length - 1} groups`);
});
