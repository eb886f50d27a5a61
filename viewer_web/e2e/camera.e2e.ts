/** The camera that frames: the cube that turns with it, the map of a walk, and views that are kept. */
import { expect, inject, test } from 'vitest';
import { violations } from './axe.ts';
import { viewerPages } from './browser.ts';
import { PlanFiles, withSite } from './plan-files.ts';

const { ground, stationsOf } = new PlanFiles(inject('planFolder'));
const openPage = viewerPages({ width: 1280, height: 800 });

test('the cube turns with the camera, its faces are ways to look at the floor, by pointer and by keys', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await page.route('**/plan/plan.json', (route) => route.fulfill({ json: withSite(inject('planFolder')) }));
  await viewer.open(`#floor=${ground.id}`);
  const faces = (): Promise<string[]> => page.locator('.cube-face:not([hidden]) text').allTextContents();
  // The scene's axes are turned by 30 degrees from those of the map.
  await expect.poll(faces).toEqual(['SE', 'SW', 'Top']);
  await page.locator('.cube-face[data-face="top"] rect').click();
  await expect.poll(faces).toEqual(['Top']);
  const above = await viewer.canvasPixels();
  const cube = page.getByRole('toolbar', { name: 'View cube' });
  await cube.getByRole('button', { name: 'View from above' }).focus();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  await expect.poll(() => page.locator('.cube-words').textContent()).toBe('View from the northeast');
  await page.keyboard.press('Enter');
  await expect.poll(faces).toEqual(['NE', 'Top']);
  expect(above.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.1);
  await viewer.screenshot('cube');
  await page.locator('.cube-turn').last().click();
  await expect.poll(faces).toEqual(['NW', 'Top']);
  await expect.poll(() => page.getByLabel('Shown floor').inputValue()).toBe(ground.id);
  expect(await violations(page)).toEqual([]);
  for (const key of ['p', 'w']) {
    await viewer.press(key);
    await expect.poll(() => page.locator('.view-cube').count()).toBe(0);
    await viewer.press('Escape');
    await viewer.press('h');
    await expect.poll(() => page.locator('.view-cube').count()).toBe(1);
  }
});

test.each([
  ['a desk', {}],
  ['a phone', { width: 390, height: 844, hasTouch: true }],
] as const)(
  'a walk has a map on %s: it follows, and leads to where one can stand and nowhere else',
  async (name, look) => {
    const viewer = await openPage(look);
    const { page } = viewer;
    const [station] = stationsOf(ground.id);
    await viewer.open(`#floor=${ground.id}&station=${station.id}`);
    await viewer.press('w');
    const map = page.locator('.walk-map');
    const me = (): Promise<number[]> =>
      page
        .getByTestId('walk-map-me')
        .evaluate((one) => (one.getAttribute('transform') ?? '').match(/-?[\d.]+/g)!.map(Number));
    const [x, y, turn] = await me();
    expect([x, -y]).toEqual([expect.closeTo(station.position[0]), expect.closeTo(station.position[1])]);
    await expect.poll(() => map.locator('.walk-map-station').count()).toBe(stationsOf(ground.id).length);
    await page.keyboard.down('ArrowLeft');
    await expect.poll(async () => (await me())[2]).not.toBe(turn);
    await page.keyboard.up('ArrowLeft');
    await page.mouse.move(0, 0);
    // To the place of another station, as the map has it.
    const dots = map.locator('.walk-map-station');
    const there = stationsOf(ground.id)[5];
    const box = (await dots.nth(5).locator('circle').boundingBox())!;
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    const near = expect.closeTo(0, 0);
    await expect
      .poll(async () => (await me()).slice(0, 2).map((value, k) => value - [there.position[0], -there.position[1]][k]))
      .toEqual([near, near]);
    await viewer.screenshot(`walk-map-${name.replaceAll(' ', '-')}`);
    const before = await me();
    const whole = (await map.locator('svg').boundingBox())!;
    await page.mouse.click(whole.x + 3, whole.y + 3);
    await map.getByText('Nobody can stand there.').waitFor();
    expect(await me()).toEqual(before);
    expect(await violations(page)).toEqual([]);
    await page.getByRole('button', { name: 'Leave walk-through' }).click();
    await expect.poll(() => map.count()).toBe(0);
  },
);

test('a view is saved with a name, opened again with floor, colour, section and camera, renamed, and deleted', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open(`#floor=${ground.id}&layer=range`);
  const views = page.getByRole('region', { name: 'Saved views' });
  const open = async (): Promise<void> => {
    await page.getByRole('button', { name: 'Views', exact: true }).click();
    await views.waitFor();
  };
  await page.locator('.cube-face[data-face="-x"] rect').click();
  await open();
  await views.getByRole('button', { name: 'Save this view' }).click();
  const first = views.locator('.views-name').first();
  await expect.poll(() => first.textContent()).toMatch(new RegExp(`^${ground.name}, `));
  expect(await violations(page)).toEqual([]);
  await views.getByRole('button', { name: /^Rename / }).click();
  await views.getByLabel('New name').fill('Hall from the west');
  await page.keyboard.press('Enter');
  await page.keyboard.press('Escape');
  const shown = await viewer.canvasPixels();

  // Another one, of a section.
  await page.locator('#site-tool-section').click();
  await page.getByRole('button', { name: 'Box', exact: true }).click();
  await page.locator('#site-tool-section').click();
  await open();
  await views.getByLabel('Name of the view').fill('Cut');
  await page.keyboard.press('Enter');
  await expect.poll(() => views.locator('.views-name').allTextContents()).toEqual(['Hall from the west', 'Cut']);

  // From a walk, and from another layer, back to the first.
  await page.keyboard.press('Escape');
  await page.getByLabel('Colour of the building').selectOption('incidence');
  await viewer.press('w');
  await page.locator('.walk-map').waitFor();
  await open();
  await first.click();
  await expect.poll(() => page.locator('.walk-map').count()).toBe(0);
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  await expect.poll(() => viewer.hash()).toMatch(new RegExp(`floor=${ground.id}&layer=range&camera=`));
  await expect.poll(() => viewer.hash()).not.toContain('box=');
  expect(shown.shareChanged(await viewer.canvasPixels())).toBeLessThan(0.02);
  await open();
  await views.locator('.views-name').last().click();
  await expect.poll(() => viewer.hash()).toContain('box=');
  await viewer.screenshot('views');

  // Other pages of this browser have them too.
  await page.reload();
  await viewer.settle();
  await expect.poll(() => viewer.hash()).toContain('box=');
  await open();
  await views.getByRole('button', { name: 'Delete Cut' }).click();
  await expect.poll(() => views.locator('.views-name').allTextContents()).toEqual(['Hall from the west']);
});

test('what the browser keeps of views may be nonsense, or refused: one message, and the page goes on', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await page.addInitScript(() => {
    const { getItem, setItem } = Storage.prototype;
    Storage.prototype.getItem = function (key) {
      return key.startsWith('tlsplan-views') ? '{"nonsense"' : getItem.call(this, key);
    };
    Storage.prototype.setItem = function (key, value) {
      if (key.startsWith('tlsplan-views')) throw new DOMException('full', 'QuotaExceededError');
      setItem.call(this, key, value);
    };
  });
  await viewer.open(`#floor=${ground.id}`);
  await page.getByRole('button', { name: 'Views', exact: true }).click();
  const views = page.getByRole('region', { name: 'Saved views' });
  await views.getByText('The views that this browser keeps cannot be read.').waitFor();
  await views.getByRole('button', { name: 'Save this view' }).click();
  await views.getByText('The browser has no room for it, or keeps nothing.').waitFor();
  await expect.poll(() => views.locator('.views-name').count()).toBe(0);
});
