/** Where everything is: states of the page at four sizes of window, without words that are cut or controls on each other. */
import { expect, inject, test } from 'vitest';
import { moveStation, type Pose, removeStation } from '../src/edit/changes.ts';
import { countingOf, networkOf } from '../src/network/graph.ts';
import { type Look, type ViewerPage, viewerPages } from './browser.ts';
import { layoutFaults } from './layout.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground, stationsOf } = new PlanFiles(inject('planFolder'));
const [first, second] = stationsOf(ground.id);
const ids = plan.stations.map(({ id }) => id);
const { components } = networkOf(ids, plan.registration.links, countingOf(plan));
/** Of another group than the largest, and not looked at by itself. */
const removed = components
  .slice(1)
  .flat()
  .filter((id) => id !== first.id && id !== second.id)[0];
const openPage = viewerPages();

const FINGERS = { hasTouch: true, isMobile: true } as const;
const WINDOWS: readonly [string, Look][] = [
  ['a desk', { width: 1440, height: 900 }],
  ['a tablet', { width: 1024, height: 768, hasTouch: true }],
  ['a phone', { width: 390, height: 844, ...FINGERS }],
  ['a small phone', { width: 340, height: 700, ...FINGERS }],
  ['a tablet in German', { width: 1024, height: 768, hasTouch: true, locale: 'de-DE' }],
  ['a small phone in German', { width: 340, height: 700, ...FINGERS, locale: 'de-DE' }],
];

/** What leads from one state to the next. Names of tabs, not words: the page is in German, too. */
const STATES: readonly [string, (viewer: ViewerPage) => Promise<unknown>][] = [
  ['overview', async () => undefined],
  ['walk', ({ page }) => page.keyboard.press('w')],
  ['room', ({ page }) => page.locator('[data-room]').first().click()],
  [
    'station',
    async ({ page }) => {
      await page.locator(`li [data-station="${first.id}"]`).click();
      await page.locator('[data-testid=cloud][data-state=shown]').waitFor();
    },
  ],
  [
    'unseen',
    async ({ page }) => {
      await page.locator('#tab-unseen').click();
      await page.locator('.unseen > button').first().click();
      await page.locator('[data-testid=legend][data-state=shown]').waitFor();
    },
  ],
  [
    'groups joined',
    async ({ page }) => {
      await page.locator('#tab-network').click();
      await page.locator('[data-group]').first().waitFor();
      expect(components.length).toBeGreaterThan(2);
      await page.getByRole('button', { name: /^(Join groups|Gruppen verbinden)$/ }).click();
      await page.locator('.ghost-marker').waitFor();
    },
  ],
  [
    'edited',
    async (viewer) => {
      const { page } = viewer;
      await page.locator('#tab-edit').click();
      const [x, y, z] = second.position;
      const to = { position_m: [x + 0.3, y, z], instrument_height_m: null, floor: ground.id } satisfies Pose;
      const moved = moveStation(second.id, to);
      expect(await viewer.changeAs('Ada', moved, removeStation(removed))).toBe(200);
      await page.locator('.draft-bar .segments').waitFor();
      await viewer.marker(first.id).press('Enter');
      await page.getByTestId('live-note').waitFor({ state: 'detached' });
    },
  ],
  ['sign-off', ({ page }) => page.locator('#tab-review').click()],
  ['hand over', ({ page }) => page.getByRole('button', { name: /^(Share|Teilen)$/ }).click()],
];

test.each(WINDOWS)('nothing is cut, covered or out of reach on %s', async (name, look) => {
  const viewer = await openPage(look);
  await viewer.open(`#floor=${ground.id}`);
  const found: Record<string, readonly string[]> = {};
  for (const [state, reach] of STATES) {
    await reach(viewer);
    await viewer.settle();
    await viewer.screenshot(`layout-${name.replaceAll(' ', '-')}-${state.replaceAll(' ', '-')}`);
    found[state] = await layoutFaults(viewer.page);
  }
  expect(found).toEqual(Object.fromEntries(STATES.map(([state]) => [state, []])));
});
