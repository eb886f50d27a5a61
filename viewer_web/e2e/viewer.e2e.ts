/** The viewer in a real browser, on a real plan from the real server. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, test } from 'vitest';
import { type PlanJson, type PlanStation, parsePlan } from '../src/load/plan-json.ts';
import { launchBrowser, ViewerPage } from './browser.ts';

const address = inject('address');
const planFolder = inject('planFolder');
const plan: PlanJson = parsePlan(JSON.parse(readFileSync(join(planFolder, 'plan.json'), 'utf8')));
const floorsLowestFirst = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m);
const stationsOf = (floorId: string): PlanStation[] => plan.stations.filter(({ floor }) => floor === floorId);

let browser: Browser;
let viewer: ViewerPage;
beforeAll(async () => {
  browser = await launchBrowser();
});
afterAll(() => browser.close());
beforeEach(async () => {
  viewer = await ViewerPage.create(browser, address);
});
afterEach(async () => {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

const shownMarkers = (): Promise<string[]> =>
  viewer.page
    .locator('.marker:not([hidden])')
    .evaluateAll((markers) => markers.map((marker) => (marker as HTMLElement).dataset.station ?? '').sort());
const checkedFloor = (): Promise<string | null> =>
  viewer.page.locator('[data-floor][aria-checked=true]').getAttribute('data-floor');
const marker = (id: string) => viewer.page.locator(`.marker[data-station="${id}"]`);

/** Click bare canvas and read what the picked surface is; null where nothing is picked or something covers the canvas. */
async function pickAt(x: number, y: number): Promise<Record<string, string> | null> {
  const close = viewer.page.getByRole('button', { name: 'Close' });
  if (await close.count()) await close.click();
  const isBare = await viewer.page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS', [x, y]);
  if (!isBare) return null;
  await viewer.page.mouse.click(x, y);
  const isPicked = (await viewer.page.getByTestId('surface-figures').count()) > 0;
  return isPicked ? viewer.figures('surface-figures') : null;
}

async function centreOf(id: string): Promise<{ x: number; y: number }> {
  const box = (await marker(id).boundingBox())!;
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

test('the page shows the building and the figures of the plan', { tags: 'main' }, async () => {
  await viewer.page.setViewportSize({ width: 1280, height: 800 });
  await viewer.open();
  const { page } = viewer;
  expect(await page.getByTestId('coverage').textContent()).toBe(
    `${(100 * plan.coverage.fraction_of_achievable).toFixed(1)} %`,
  );
  expect(await page.getByTestId('station-count').textContent()).toBe(String(plan.stations.length));
  expect(await page.locator('li [data-station]').count()).toBe(plan.stations.length);
  expect(await page.title()).toContain(plan.scene.file);
  const pixels = await viewer.canvasPixels();
  const background = pixels.at(990, 340);
  const drawn = pixels.share((rgb) => rgb.some((value, k) => Math.abs(value - background[k]) > 8));
  expect(drawn).toBeGreaterThan(0.15);
  expect(drawn).toBeLessThan(0.95);
  await viewer.screenshot('1-all-floors');
});

test('the floor selector changes the picture and shows only the markers of that floor', { tags: 'main' }, async () => {
  await viewer.open();
  let before = await viewer.canvasPixels();
  for (const floor of floorsLowestFirst) {
    await viewer.page.locator(`[data-floor="${floor.id}"]`).click();
    await viewer.settle();
    const after = await viewer.canvasPixels();
    expect(before.shareChanged(after)).toBeGreaterThan(0.05);
    expect(await shownMarkers()).toEqual(stationsOf(floor.id).map(({ id }) => id));
    expect(await viewer.page.locator('li [data-station]').count()).toBe(stationsOf(floor.id).length);
    await viewer.screenshot(`2-floor-${floor.id}`);
    before = after;
  }
  await viewer.page.getByLabel('Height of the cut').fill('0.4');
  await viewer.settle();
  expect(before.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.02);
  await viewer.page.locator('[data-floor=all]').click();
  await viewer.page.getByText('Spread floors apart').click();
  await viewer.settle();
  expect(await shownMarkers()).toEqual(plan.stations.map(({ id }) => id).sort());
  await viewer.screenshot('2-whole-building');
});

test('markers stand where plan.json has the stations', async () => {
  const floor = floorsLowestFirst[0];
  await viewer.open(`#floor=${floor.id}`);
  await viewer.page.keyboard.press('t');
  await viewer.settle();
  let nPicked = 0;
  for (const station of stationsOf(floor.id)) {
    const centre = await centreOf(station.id);
    // Beside the marker: what is seen there lies beside the station, seen from straight above.
    const picked = await pickAt(centre.x, centre.y + 18);
    if (picked === null) continue;
    nPicked++;
    const at = picked.Position.split(', ').map(Number);
    expect(Math.hypot(at[0] - station.position[0], at[1] - station.position[1]), station.id).toBeLessThan(1);
  }
  expect(nPicked).toBeGreaterThan(stationsOf(floor.id).length / 2);
  await viewer.screenshot('3-from-above');
});

test('a click on a marker shows the figures of plan.json and the cloud', { tags: 'main' }, async () => {
  const station = stationsOf(floorsLowestFirst[0].id)[0];
  await viewer.open(`#floor=${station.floor}`);
  const before = await viewer.canvasPixels();
  const centre = await centreOf(station.id);
  await viewer.page.mouse.click(centre.x, centre.y);
  await viewer.page.locator('[data-testid=cloud][data-state=shown]').waitFor();
  await viewer.settle();
  const [x, y, z] = station.position.map((value) => `${value.toFixed(3)} m`);
  expect(await viewer.figures('station-figures')).toMatchObject({
    x,
    y,
    z,
    'Instrument height': `${station.instrument_height_m?.toFixed(2)} m`,
    'Seen area': `${station.covered_area_m2.toFixed(1)} m²`,
    'Unique area': `${station.own_area_m2.toFixed(1)} m²`,
  });
  const links = plan.registration.links.filter(({ a, b }) => a === station.id || b === station.id);
  const strong = links.filter(({ overlap }) => overlap >= plan.registration.threshold);
  expect(await viewer.page.locator('.links .chip-strong').count()).toBe(Math.min(8, strong.length));
  expect(await marker(station.id).getAttribute('aria-pressed')).toBe('true');
  expect(await viewer.hash()).toBe(`#floor=${station.floor}&station=${station.id}`);

  const cloud = readFileSync(join(planFolder, 'viewer', 'clouds', `${station.id}.u16`));
  let nReturns = 0;
  for (let i = 0; i < cloud.length / 3; i++) if (cloud.readUInt16LE(2 * i) > 0) nReturns++;
  expect(await viewer.page.getByTestId('cloud').textContent()).toContain(nReturns.toLocaleString('en'));
  const after = await viewer.canvasPixels();
  expect(before.shareChanged(after)).toBeGreaterThan(0.1);
  // The building has stepped back to grey: what is strongly coloured is the cloud.
  expect(after.share((rgb) => Math.max(...rgb) - Math.min(...rgb) > 70)).toBeGreaterThan(0.01);
  await viewer.screenshot('4-station');

  await viewer.page.getByLabel('Colour of the cloud').selectOption('intensity');
  await viewer.settle();
  expect((await viewer.canvasPixels()).share((rgb) => Math.max(...rgb) - Math.min(...rgb) > 70)).toBeLessThan(0.005);
  await viewer.screenshot('4-station-intensity');
});

async function groundPicked(): Promise<string | undefined> {
  return (await viewer.figures('surface-figures'))['Walkable floor'];
}

test('a click on ground picks its floor', async () => {
  for (const floor of floorsLowestFirst) {
    await viewer.open();
    let picked: string | null = 'all';
    for (const id of await shownMarkers()) {
      if (!stationsOf(floor.id).some((station) => station.id === id)) continue;
      const centre = await centreOf(id);
      for (const aside of [0, 30, -30, 60, -60]) {
        await viewer.page.mouse.click(centre.x + aside, centre.y + 22);
        picked = await checkedFloor();
        if (picked === floor.id && (await groundPicked()) === floor.name) break;
      }
      if (picked === floor.id && (await groundPicked()) === floor.name) break;
    }
    expect(picked).toBe(floor.id);
    expect(await groundPicked()).toBe(floor.name);
    expect((await viewer.hash()).split('&')[0]).toBe(`#floor=${floor.id}`); // a marker may have been hit on the way
  }
  await viewer.screenshot('5-picked-ground');
});

/** Colours of src/scene/palette.ts as ground shows them, where light falls straight; light theme. */
const GROUND_COLOURS: Record<string, [number, number, number]> = {
  'no station': [0xe8, 0x83, 0x3a],
  '1 station': [0xa9, 0xd9, 0xd3],
  '2 stations': [0x62, 0xb6, 0xb7],
  '3 stations': [0x2b, 0x8a, 0x9b],
  'not scannable': [0xc6, 0xca, 0xcc],
};
const SEEN_OFTEN: [number, number, number] = [0x17, 0x60, 0x7a];

test('the colour of ground is what the patch under the pointer is', async () => {
  await viewer.open(`#floor=${floorsLowestFirst[0].id}`);
  await viewer.page.keyboard.press('t');
  await viewer.settle();
  const pixels = await viewer.canvasPixels();
  const found = new Set<string>();
  let nGround = 0;
  for (let i = 0; i < 6; i++) {
    for (let j = 0; j < 5; j++) {
      const [x, y] = [430 + 79 * i, 150 + 83 * j];
      // Not at the rim of a patch or at a line, where a pixel is partly one and partly the other.
      if (!pixels.isEvenAround(x, y)) continue;
      const shown = await pickAt(x + 0.5, y + 0.5);
      if (shown?.['Walkable floor'] === undefined) continue;
      const expected = GROUND_COLOURS[shown['Seen from']] ?? SEEN_OFTEN;
      nGround++;
      found.add(shown['Seen from']);
      const differences = pixels.at(x, y).map((value, k) => Math.abs(value - expected[k]));
      expect(Math.max(...differences), `${shown['Seen from']} at ${x}, ${y}: ${pixels.at(x, y)}`).toBeLessThanOrEqual(
        4,
      );
    }
  }
  expect(nGround).toBeGreaterThan(8);
  expect(found.size).toBeGreaterThan(2);
});

test('the keyboard chooses floors and stations and lets go', async () => {
  await viewer.open();
  const { keyboard } = viewer.page;
  const [lowest, next] = floorsLowestFirst;
  const steps: [string, string, string | null][] = [
    ['1', lowest.id, null],
    ['ArrowUp', next.id, null],
    ['ArrowRight', next.id, stationsOf(next.id)[0].id],
    ['ArrowRight', next.id, stationsOf(next.id)[1 % stationsOf(next.id).length].id],
    ['Escape', next.id, null],
    ['ArrowDown', lowest.id, null],
    ['Escape', 'all', null],
    ['2', next.id, null],
    ['0', 'all', null],
  ];
  for (const [key, floorId, stationId] of steps) {
    await keyboard.press(key);
    await viewer.settle();
    expect(await checkedFloor(), key).toBe(floorId);
    expect(await viewer.page.locator('li [aria-pressed=true]').count(), key).toBe(stationId === null ? 0 : 1);
    if (stationId !== null) expect(await viewer.hash()).toContain(`station=${stationId}`);
  }
});

test('plain painting takes the coverage colours away', async () => {
  await viewer.open();
  const isTeal = ([r, g, b]: readonly number[]): boolean => b > r + 60 && g > r + 40;
  expect((await viewer.canvasPixels()).share(isTeal)).toBeGreaterThan(0.03);
  await viewer.page.getByLabel('Colour of the building').selectOption('plain');
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isTeal)).toBe(0);
  await viewer.screenshot('6-plain');
});

test('a view in the address is restored', async () => {
  const station = stationsOf(floorsLowestFirst[1].id)[0];
  await viewer.open(`#floor=${station.floor}&station=${station.id}`);
  expect(await checkedFloor()).toBe(station.floor);
  expect(await viewer.page.getByRole('heading', { name: `Station ${station.id}` }).count()).toBe(1);
  await viewer.open('#floor=nowhere&station=nothing');
  await expect.poll(checkedFloor).toBe('all');
});

test.each([
  { width: 820, height: 1180, colorScheme: 'light' as const },
  { width: 1024, height: 768, colorScheme: 'dark' as const },
])('controls fit and have names at $width x $height, $colorScheme', async (look) => {
  await viewer.page.close();
  viewer = await ViewerPage.create(browser, address, look);
  await viewer.open();
  const controls = viewer.page.locator('button:visible, input:visible, select:visible, canvas');
  const nameless = await controls.evaluateAll((all) =>
    all
      .filter(
        (one) => !(one.getAttribute('aria-label') || one.textContent?.trim() || one.closest('label')?.textContent),
      )
      .map((one) => one.outerHTML),
  );
  expect(nameless).toEqual([]);
  const tooWide = await viewer.page.evaluate(() =>
    [...document.querySelectorAll('.toolbar > *, .corner > *, .sidebar, .tabs button')]
      .filter((one) => one.getBoundingClientRect().right > window.innerWidth || one.getBoundingClientRect().left < 0)
      .map((one) => one.className),
  );
  expect(tooWide).toEqual([]);
  await viewer.page.locator('li [data-station]').first().click();
  await viewer.page.locator('[data-testid=cloud][data-state=shown]').waitFor();
  await viewer.settle();
  await viewer.screenshot(`7-${look.width}-${look.colorScheme}`);
});

test.each([
  ['plan.json', '{"schema": "tlsplan/plan/9"}', /schema is "tlsplan\/plan\/9".*this version of tlsplan/],
  ['plan.json', 'no json', /plan\.json: not JSON/],
  ['viewer/stage.usdc', 'PXR-USDC', /stage\.usdc can't be read/],
  ['viewer/patches.u8', 'x', /patches\.u8: 1 patches, expected at least/],
])('a damaged %s (%s) is told in words', async (file, body, words) => {
  await viewer.page.route(`**/plan/${file}`, (route) => route.fulfill({ body }));
  await viewer.page.goto(address);
  await viewer.page.getByRole('alert').waitFor();
  expect(await viewer.page.getByRole('alert').textContent()).toMatch(words);
});

test('a file that is missing is told in words', async () => {
  await viewer.page.route('**/plan/viewer/stage.usdc', (route) => route.fulfill({ status: 404 }));
  await viewer.page.goto(address);
  await viewer.page.getByRole('alert').waitFor();
  expect(await viewer.page.getByRole('alert').textContent()).toMatch(/stage\.usdc.*404.*not complete/);
  // The browser itself notes the failed request.
  expect(viewer.faults.splice(0)).toEqual([expect.stringContaining('404')]);
});
