/** The viewer in a real browser, on a real plan from the real server. */
import { beforeEach, expect, inject, test } from 'vitest';
import { rgbOf } from '../src/heat/colors.ts';
import { deltaE2000 } from '../src/testing/delta-e.ts';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const address = inject('address');
const { floors: floorsLowestFirst, stationsOf } = new PlanFiles(inject('planFolder'));

const openPage = viewerPages();
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await openPage();
});

const checkedFloor = (): Promise<string | null> =>
  viewer.page.locator('[data-floor][aria-checked=true]').getAttribute('data-floor');
/** Click bare canvas and read what the picked surface is; null where nothing is picked or something covers the canvas. */
async function pickAt(x: number, y: number): Promise<Record<string, string> | null> {
  const close = viewer.page.getByRole('button', { name: 'Close' });
  if (await close.count()) await close.click();
  if (!(await viewer.isBare(x, y))) return null;
  await viewer.page.mouse.click(x, y);
  const isPicked = (await viewer.page.getByTestId('surface-figures').count()) > 0;
  return isPicked ? viewer.figures('surface-figures') : null;
}

test('markers stand where plan.json has the stations', async () => {
  const floor = floorsLowestFirst[0];
  await viewer.open(`#floor=${floor.id}`);
  await viewer.press('t');
  let nPicked = 0;
  for (const station of stationsOf(floor.id)) {
    const [x, y] = await viewer.centreOf(station.id);
    // Beside the marker: what is seen there lies beside the station, seen from straight above.
    const picked = await pickAt(x, y + 18);
    if (picked === null) continue;
    nPicked++;
    const at = picked.Position.split(', ').map(Number);
    expect(Math.hypot(at[0] - station.position[0], at[1] - station.position[1]), station.id).toBeLessThan(1);
  }
  expect(nPicked).toBeGreaterThan(stationsOf(floor.id).length / 2);
  await viewer.screenshot('3-from-above');
});

async function groundPicked(): Promise<string | undefined> {
  return (await viewer.figures('surface-figures'))['Walkable floor'];
}

test('a click on ground picks its floor', async () => {
  for (const floor of floorsLowestFirst) {
    await viewer.open();
    let picked: string | null = 'all';
    for (const id of await viewer.shownStations()) {
      if (!stationsOf(floor.id).some((station) => station.id === id)) continue;
      const [x, y] = await viewer.centreOf(id);
      for (const aside of [0, 30, -30, 60, -60]) {
        await viewer.page.mouse.click(x + aside, y + 22);
        picked = await checkedFloor();
        if (picked === floor.id && (await groundPicked()) === floor.name) break;
      }
      if (picked === floor.id && (await groundPicked()) === floor.name) break;
    }
    expect(picked).toBe(floor.id);
    await expect.poll(groundPicked).toBe(floor.name);
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
  await viewer.press('t');
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

/** Classes of the legend by what the card of a surface gives as `Seen from`. */
const CLASS_OF: Record<string, string> = {
  'no station': 'unseen',
  '1 station': '1',
  '2 stations': '2',
  '3 stations': '3',
  'not scannable': 'not scannable',
};

test('the colour of walls and furniture is nearest to that of its own class in the legend', async () => {
  await viewer.open(`#floor=${floorsLowestFirst[0].id}`);
  const swatches = await viewer.page
    .getByTestId('legend')
    .locator('li')
    .evaluateAll((all) => all.map((one) => [one.textContent, one.querySelector('rect')!.getAttribute('fill')!]));
  const pixels = await viewer.canvasPixels();
  await viewer.screenshot('11-classes');
  const found = new Set<string>();
  for (let i = 0; i < 6; i++) {
    for (let j = 0; j < 6; j++) {
      const [x, y] = [474 + 48 * i, 200 + 60 * j];
      if (!pixels.isEvenAround(x, y)) continue;
      const shown = await pickAt(x + 0.5, y + 0.5);
      if (shown === null || shown['Walkable floor'] !== undefined || shown['Seen from'] === 'cut section') continue;
      const distances = swatches.map(([label, hex]) => [deltaE2000(pixels.at(x, y), rgbOf(hex)), label] as const);
      const nearest = distances.reduce((best, one) => (one[0] < best[0] ? one : best));
      const own = CLASS_OF[shown['Seen from']] ?? '4+';
      expect(nearest, `${own} at ${x}, ${y}: ${pixels.at(x, y)}`).toEqual([expect.any(Number), own]);
      expect(nearest[0], `${own} at ${x}, ${y}: ${pixels.at(x, y)}`).toBeLessThan(4);
      found.add(own);
    }
  }
  expect(found.size).toBeGreaterThan(2);
});

test('the keyboard chooses floors and stations and lets go', async () => {
  await viewer.open();
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
    await viewer.press(key);
    expect(await checkedFloor(), key).toBe(floorId);
    expect(await viewer.page.locator('li [aria-pressed=true]').count(), key).toBe(stationId === null ? 0 : 1);
    if (stationId !== null) await expect.poll(() => viewer.hash()).toContain(`station=${stationId}`);
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

test('what no station sees is hatched on demand, in legend and building, and the browser keeps that', async () => {
  await viewer.open(`#floor=${floorsLowestFirst[0].id}`);
  const { page } = viewer;
  const before = await viewer.canvasPixels();
  const isUnseen = ([r, g, b]: readonly number[]): boolean => r > 190 && g > 90 && g < 150 && b < 90;
  await page.getByRole('button', { name: 'Hatch' }).click();
  await viewer.settle();
  const hatched = await viewer.canvasPixels();
  await viewer.screenshot('hatch');
  // Lines take about a third of what is unseen, and nothing else changes.
  expect(hatched.share(isUnseen) / before.share(isUnseen)).toBeLessThan(0.85);
  expect(before.shareChanged(hatched)).toBeLessThan(1.2 * before.share(isUnseen));
  await page.reload();
  await expect.poll(() => page.getByRole('button', { name: 'Hatch' }).getAttribute('aria-pressed')).toBe('true');
  await expect.poll(() => page.locator('.legend .swatch path').count()).toBe(1);
  await page.getByRole('button', { name: 'Hatch' }).click();
  await expect.poll(() => page.locator('.legend .swatch path').count()).toBe(0);
  await viewer.settle();
  expect(before.shareChanged(await viewer.canvasPixels())).toBeLessThan(0.005);
});

test('a view in the address is restored', async () => {
  const station = stationsOf(floorsLowestFirst[1].id)[0];
  await viewer.open(`#floor=${station.floor}&station=${station.id}`);
  await expect.poll(checkedFloor).toBe(station.floor);
  await expect.poll(() => viewer.page.getByRole('heading', { name: `Station ${station.id}` }).count()).toBe(1);
  await viewer.open('#floor=nowhere&station=nothing');
  await expect.poll(checkedFloor).toBe('all');
});

test.each([
  { width: 820, height: 1180, colorScheme: 'light' as const },
  { width: 1024, height: 768, colorScheme: 'dark' as const },
])('controls fit and have names at $width x $height, $colorScheme', async (look) => {
  viewer = await openPage(look);
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
])('a damaged %s (%s) is explained', async (file, body, words) => {
  await viewer.page.route(`**/plan/${file}`, (route) => route.fulfill({ body }));
  await viewer.page.goto(address);
  await viewer.page.getByRole('alert').waitFor();
  await expect.poll(() => viewer.page.getByRole('alert').textContent()).toMatch(words);
});

test('a file that is missing is explained', async () => {
  await viewer.page.route('**/plan/viewer/stage.usdc', (route) => route.fulfill({ status: 404 }));
  await viewer.page.goto(address);
  await viewer.page.getByRole('alert').waitFor();
  await expect.poll(() => viewer.page.getByRole('alert').textContent()).toMatch(/stage\.usdc.*404.*not complete/);
  // The browser itself notes the failed request.
  expect(viewer.faults.splice(0)).toEqual([expect.stringContaining('404')]);
});
