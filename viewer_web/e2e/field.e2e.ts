/** The field view in a real browser: ticks that stay on the device, no network, stations at one position. */
import { beforeEach, expect, inject, test } from 'vitest';
import { draftStations } from '../src/edit/draft.ts';
import { routeStops } from '../src/field/route.ts';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const address = inject('address');
const { plan } = new PlanFiles(inject('planFolder'));
const stops = routeStops(plan, draftStations(plan, null));

const openPage = viewerPages({ width: 768, height: 1024, hasTouch: true });
let viewer: ViewerPage;
beforeEach(async () => {
  // A tablet, held upright.
  viewer = await openPage();
  await viewer.page.goto(`${address}#view=field`);
  await viewer.page.getByTestId('field-count').waitFor();
});

/** Wait until a part of the page has a text: a tap has its effect a moment after the finger is gone. */
const reads = (id: string, words: string): Promise<void> =>
  expect.poll(() => viewer.page.getByTestId(id).textContent()).toBe(words);

test('ticks stay on the device, work without a network, and can be taken back', async () => {
  await viewer.page.getByRole('button', { name: 'Done', exact: true }).tap();
  await reads('field-count', `1 of ${stops.length}`);
  await viewer.page.reload();
  await reads('field-count', `1 of ${stops.length}`);
  await viewer.page.context().setOffline(true);
  await viewer.page.getByRole('button', { name: 'Done', exact: true }).tap();
  await reads('field-station', stops[2].stationId);
  await viewer.page.getByRole('checkbox', { name: `${stops[0].stationId} done` }).uncheck();
  await reads('field-station', stops[0].stationId);
  await reads('field-count', `1 of ${stops.length}`);
  await viewer.page.context().setOffline(false);
  // The page notes that events could not be had meanwhile.
  viewer.faults.splice(0);
});

test('stations are those of the review, by their own numbers', async () => {
  const [first, second, third] = stops;
  const [x, y, z] = first.positionM;
  await viewer.changeAs('Ben', { kind: 'remove_station', station: second.stationId });
  await viewer.changeAs('Ben', { kind: 'add_station', position_m: [x + 0.3, y, z], floor: first.floorId });
  const rows = viewer.page.locator('.field-stop');
  const ids = [first.stationId, `S0${stops.length + 1}`, third.stationId];
  await expect.poll(async () => (await rows.locator('.field-stop-name').allTextContents())[1]).toContain(ids[1]);
  const shown = await rows.evaluateAll((all) => all.map((row) => row.textContent?.match(/^(\d+)(S\d+)/)?.slice(1)));
  expect(shown.slice(0, 3)).toEqual(ids.map((id) => [`${Number(id.slice(1))}`, id]));
  expect(shown).toHaveLength(stops.length);
  await viewer.page.getByText('ways to and from these are not known').waitFor();
  await viewer.screenshot('field-4-reviewed');
});

test('any station can be looked up, and the whole plan is a tap away', async () => {
  const last = stops[stops.length - 1];
  await viewer.page
    .getByRole('button', { name: new RegExp(`^\\S*\\s*${last.stationId}`) })
    .last()
    .tap();
  await reads('field-station', last.stationId);
  await viewer.page.getByRole('button', { name: 'Full plan' }).tap();
  await viewer.page.locator('.marker').first().waitFor({ state: 'attached' });
  await expect.poll(() => viewer.hash()).not.toContain('view=field');
});

test('stations at one spot are one dot with their number, and a tap lists them', async () => {
  const [first, second] = stops.filter(({ floorId }) => floorId === stops[0].floorId);
  const atOneSpot = plan.stations.map((station) =>
    station.id === second.stationId
      ? { ...station, position: [first.positionM[0], first.positionM[1], first.positionM[2] + 0.4] }
      : station,
  );
  const { page } = viewer;
  await page.route('**/plan/plan.json', async (route) => {
    const body = await (await route.fetch()).json();
    await route.fulfill({ json: { ...body, stations: atOneSpot } });
  });
  await page.reload();
  await page.getByTestId('field-count').waitFor();
  const map = page.getByRole('group', { name: 'Map of the floor' });
  const stack = map.getByRole('button', { name: /^\d stations here: / });
  await expect
    .poll(() => stack.first().getAttribute('aria-label'))
    .toContain(`${first.stationId}; ${second.stationId}`);
  await stack.first().tap();
  const list = page.getByRole('region', { name: 'Stations at this position' });
  await viewer.screenshot('field-3-one-spot');
  await list.getByRole('button', { name: new RegExp(second.stationId) }).tap();
  await list.waitFor({ state: 'detached' });
  await reads('field-station', second.stationId);
});

test('the field view loads less than 80 kB, in German, too, and the application in 3D with the whole plan', async () => {
  const { page } = viewer;
  const loaded = () =>
    page.evaluate(async () => {
      const files = [window.location.pathname, ...performance.getEntriesByType('resource').map(({ name }) => name)];
      const ours = [...new Set(files)].filter((name) => name === '/' || name.includes('/assets/'));
      // As a host sends them that compresses; not all do.
      const sizes = ours.map(async (name) => {
        const zipped = (await fetch(name)).body!.pipeThrough(new CompressionStream('gzip'));
        return [name.replace(/^.*\//, ''), (await new Response(zipped).arrayBuffer()).byteLength] as const;
      });
      return Object.fromEntries(await Promise.all(sizes));
    });
  for (const language of ['de', 'en']) {
    await page.evaluate((chosen) => window.localStorage.setItem('tlsplan-language', chosen), language);
    await page.reload();
    await page.getByTestId('field-count').waitFor();
    const inField = await loaded();
    const parts = Object.keys(inField).map((name) => name.split('-')[0]);
    expect(parts).toContain('index');
    expect(parts.includes('first')).toBe(language === 'de');
    expect(parts.filter((name) => /^(workspace|stage|rest)$/.test(name))).toEqual([]);
    expect(Object.values(inField).reduce((sum, n) => sum + n, 0)).toBeLessThan(80_000);
  }
  await page.getByRole('button', { name: 'Full plan' }).click();
  await page.locator('.toolbar').waitFor();
  await expect.poll(() => page.getByTestId('station-count').textContent()).toBe(String(plan.stations.length));
  expect(Object.keys(await loaded()).some((name) => name.startsWith('workspace-'))).toBe(true);
  await expect.poll(() => viewer.hash()).not.toContain('view=field');
});
