/** Inspection in a real browser: layers, floors outside the plan, unique areas, the walk-through and the route. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { beforeEach, expect, inject, test } from 'vitest';
import { quantity } from '../src/heat/quantity.ts';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const files = new PlanFiles(inject('planFolder'));
const { plan, floors, ground, stationsOf } = files;

const openPage = viewerPages({ width: 1280, height: 800 });
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await openPage();
});

const legend = () => viewer.page.getByTestId('legend');
const isPurple = ([r, g, b]: readonly number[]): boolean => b > g + 40 && r > g + 25;
const areaIn = (text: string | null): number => Number(/([\d.,]+) m²/.exec(text ?? '')?.[1].replace(',', ''));

async function choose(layerId: string): Promise<void> {
  await viewer.page.getByLabel('Colour of the building').selectOption(layerId);
  await viewer.page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
}

test('every layer has a legend and a picture of its own', async () => {
  await viewer.open(`#floor=${ground.id}`);
  let before = await viewer.canvasPixels();
  const ids = ['seen', ...files.layers.layers.map(({ id }) => id), 'reason'];
  expect(ids).toEqual(expect.arrayContaining(['range', 'incidence', 'spacing']));
  for (const id of ids) {
    await choose(id);
    const title = await viewer.page.locator(`option[value="${id}"]`).textContent();
    await expect.poll(() => legend().textContent()).toContain(title);
    const after = await viewer.canvasPixels();
    expect(before.shareChanged(after), id).toBeGreaterThan(0.01);
    before = after;
    await viewer.screenshot(`i-layer-${id}`);
  }
  await expect.poll(() => viewer.hash()).toContain('layer=reason');
});

test('a clicked surface has the figures that the files have of its patch', async () => {
  await viewer.open(`#floor=${ground.id}&layer=${files.layers.layers[0].id}`);
  await viewer.press('t');
  let nCompared = 0;
  for (let i = 0; i < 12; i++) {
    for (let j = 0; j < 9 && nCompared < 12; j++) {
      // From the middle outwards: some buildings are narrow.
      const [x, y] = [810 + (i % 2 ? -1 : 1) * 36 * i, 150 + 62 * j];
      if (!(await viewer.isBare(x, y))) continue;
      await viewer.page.mouse.click(x, y);
      const card = viewer.page.getByTestId('surface-figures');
      if ((await card.count()) === 0) continue;
      const patch = Number(await card.getAttribute('data-patch'));
      const shown = await viewer.figures('surface-figures');
      const [layer] = files.layers.layers;
      const value = files.values(layer.file)[patch];
      if (shown['Seen from'] === 'cut section') continue;
      expect(shown[layer.title]).toBe(value === layer.none ? undefined : quantity(value * layer.step, layer.unit));
      const seen = files.bytes('patches.u8')[patch];
      expect(shown['Seen from']).toMatch(
        seen === 255 ? /not scannable/ : seen === 0 ? /no station/ : new RegExp(`^${seen} station`),
      );
      expect(shown.Coverage).toBeDefined();
      nCompared++;
    }
  }
  expect(nCompared).toBeGreaterThan(5);
  await viewer.screenshot('i-clicked');
});

const isOrange = ([r, g, b]: readonly number[]): boolean => r > g + 50 && g > b + 20;

test('floors outside the plan are neither seen nor unseen, and comparisons leave them out', async () => {
  const { page } = viewer;
  // The same plan, as if the ground floor alone were required, and nothing that it leaves unseen.
  const [upper] = floors.slice(1);
  const some = JSON.parse(readFileSync(join(inject('planFolder'), 'plan.json'), 'utf8'));
  some.requirements.floors = [ground.name];
  const reasons = files.bytes('reason.u8').map((reason) => (reason === 0 ? 0 : 255));
  await viewer.open(`#floor=${upper.id}&layer=seen`);
  const before = await viewer.canvasPixels();
  expect(before.share(isOrange)).toBeGreaterThan(0.002);
  await expect.poll(() => legend().textContent()).not.toContain('not to be covered');

  const serve = async (folder: string): Promise<void> => {
    await page.route(`**/plan/${folder}plan.json`, (route) => route.fulfill({ json: some }));
    await page.route(`**/plan/${folder}viewer/reason.u8`, (route) => route.fulfill({ body: Buffer.from(reasons) }));
  };
  await serve('');
  await page.goto('about:blank');
  await viewer.open(`#floor=${ground.id}&layer=seen`);
  await expect.poll(() => legend().textContent()).toContain('not to be covered');
  await page.locator(`[data-floor=${upper.id}]`).click();
  await viewer.settle();
  const after = await viewer.canvasPixels();
  expect(after.share(isOrange)).toBeLessThan(0.0005);
  await expect.poll(() => page.locator(`[data-floor=${upper.id}]`).textContent()).toContain('not in this plan');
  await viewer.screenshot('i-some-floors');
  await page.unrouteAll();

  await serve('runs/R009/plan/');
  await page.route('**/plan/runs/R009/plan/viewer/patches.u8', (route) =>
    route.fulfill({ body: Buffer.from(files.bytes('patches.u8')) }),
  );
  await page.goto('about:blank');
  await viewer.open('#tab=runs&layer=difference&compare=runs/R009/plan');
  await page.getByTestId('comparison').waitFor();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await expect.poll(() => legend().textContent()).toContain('not to be covered, or in one plan only');
  const included = page.getByText(/^The plan includes /);
  await expect
    .poll(() => included.textContent())
    .toBe(
      `The plan includes ${floors.map(({ name }) => name).join(' and ')}; Run R009 includes ${ground.name}. ` +
        `Only ${ground.name} is compared.`,
    );
  const row = page.getByTestId('comparison').locator('tr', { hasText: `Coverage, ${upper.name}` });
  await expect.poll(() => row.textContent()).toContain('not planned');
  await viewer.screenshot('i-compare-floors');
});

test('the list of stations sorts by unique area, and its card highlights that', async () => {
  await viewer.open(`#floor=${ground.id}`);
  const { page } = viewer;
  await page.getByRole('button', { name: 'Unique area', exact: true }).click();
  const shown = await page.locator('li [data-station]').evaluateAll((all) => all.map((one) => one.dataset.station));
  const byOwn = [...stationsOf(ground.id)].sort((a, b) => b.own_area_m2 - a.own_area_m2 || a.order - b.order);
  expect(shown).toEqual(byOwn.map(({ id }) => id));
  // What is seen from the stairs alone is above them, out of sight from here.
  const most = byOwn.find(({ position: [, , z] }) => z < ground.elevation_m + 1.5)!;
  await page.locator(`li [data-station="${most.id}"]`).click();
  await page.locator('[data-testid=cloud][data-state=shown]').waitFor();
  await page.getByText('Highlight unique area').click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  const area = areaIn(await legend().textContent());
  expect(Math.abs(area - most.own_area_m2)).toBeLessThan(0.1 + 0.02 * most.own_area_m2);
  expect((await viewer.canvasPixels()).share(isPurple)).toBeGreaterThan(0.002);
  await viewer.screenshot('i-own-surface');
});

async function cameraOf(): Promise<number[]> {
  const camera = new URLSearchParams((await viewer.hash()).slice(1)).get('camera');
  return (camera ?? '').split(',').map(Number);
}

/** Let so many pictures be drawn. */
async function pictures(n: number): Promise<void> {
  for (let i = 0; i < n; i++) await viewer.settle();
}

test('the building is walked at eye height with keys, and left with Escape', async () => {
  const station = stationsOf(ground.id)[0];
  await viewer.open(`#floor=${ground.id}&station=${station.id}`);
  const { page } = viewer;
  await page.getByRole('button', { name: 'View from here' }).click();
  await viewer.settle();
  const [start, before] = [await cameraOf(), await viewer.hash()];
  await page.keyboard.down('ArrowLeft');
  await page.waitForFunction((old) => location.hash !== old, before);
  await page.keyboard.up('ArrowLeft');
  const turnedTo = await cameraOf();
  expect(turnedTo.slice(0, 3)).toEqual(start.slice(0, 3));
  expect(Math.hypot(turnedTo[3] - start[3], turnedTo[4] - start[4])).toBeGreaterThan(0.01);
  // Some direction is free.
  let farM = 0;
  for (const key of ['w', 's', 'a', 'd']) {
    await page.keyboard.down(key);
    // A picture is a tenth of a second of the way at most, however slowly it is drawn.
    await pictures(10);
    await page.keyboard.up(key);
    const at = await cameraOf();
    farM = Math.max(farM, Math.hypot(at[0] - start[0], at[1] - start[1]));
    // On the ground all the while: no higher or lower than a step.
    expect(Math.abs(at[2] - start[2])).toBeLessThan(0.7);
    if (farM > 0.1) break;
  }
  expect(farM).toBeGreaterThan(0.1);
  await viewer.screenshot('i-walk');
  await page.keyboard.press('Escape');
  await viewer.settle();
  await expect.poll(() => page.getByRole('region', { name: 'Walk-through' }).count()).toBe(0);
});

test('the route is drawn and stepped through from stop to stop', async () => {
  await viewer.open(`#floor=${ground.id}`);
  const { page } = viewer;
  const before = await viewer.canvasPixels();
  await page.getByText('Show route').click();
  await viewer.settle();
  expect(before.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.002);
  for (const id of plan.route!.order.slice(0, 3)) {
    await page.getByRole('button', { name: 'Next ›' }).click();
    await expect.poll(() => page.getByRole('heading', { name: `Station ${id}` }).count()).toBe(1);
  }
  await expect
    .poll(() => page.locator('.route-steps').textContent())
    .toContain(`stop 3 of ${plan.route!.order.length}`);
  await viewer.screenshot('i-route');
});

test('ceilings and roofs are hidden, and walls stay in their full height', async () => {
  await viewer.open();
  await viewer.page.getByText('Spread floors apart').click();
  await viewer.settle();
  const closed = await viewer.canvasPixels();
  await viewer.page.getByText('Hide ceilings and roofs').click();
  await viewer.settle();
  const open = await viewer.canvasPixels();
  expect(closed.shareChanged(open)).toBeGreaterThan(0.05);
  await viewer.screenshot('i-no-ceilings');
});

test('a plan of an older version is shown, and says what it lacks', async () => {
  await viewer.page.route('**/plan/viewer/layers.json', (route) => route.fulfill({ status: 404 }));
  await viewer.open(`#floor=${ground.id}&layer=range`);
  await expect.poll(() => legend().textContent()).toMatch(/no layer "range".*older version.*Plan again/);
  await viewer.page.getByLabel('Colour of the building').selectOption('times_seen');
  await viewer.page.locator('[data-testid=legend][data-state=shown]').waitFor();
  expect(viewer.faults.splice(0)).toEqual([expect.stringContaining('404')]);
});

test('on a tablet fingers walk and choose', async () => {
  viewer = await openPage({ width: 820, height: 1180, hasTouch: true });
  await viewer.open(`#floor=${ground.id}`);
  const { page } = viewer;
  await page.locator('.marker:not([hidden])').first().tap();
  await page.getByRole('button', { name: 'View from here' }).tap();
  await viewer.settle();
  const before = await viewer.hash();
  const turn = (await page.getByRole('button', { name: 'Turn left' }).boundingBox())!;
  await page.mouse.move(turn.x + 10, turn.y + 10);
  await page.mouse.down();
  await page.waitForFunction((old) => location.hash !== old, before);
  await page.mouse.up();
  await viewer.screenshot('i-tablet');
  await page.getByRole('button', { name: 'Leave walk-through' }).tap();
  await page.getByRole('button', { name: 'Leave walk-through' }).waitFor({ state: 'detached' });
});
