/** A whole review, from opening to sign-off, by fingers alone and by keys alone: each step is a picture, in order. */
import type { Locator } from 'playwright-core';
import { beforeEach, expect, inject, test } from 'vitest';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const [first, second] = stationsOf(floor.id);

const openPage = viewerPages({ width: 1024, height: 768 });
let viewer: ViewerPage;
let takes = 0;
beforeEach(() => {
  takes = 0;
});

async function film(reel: string, what: string): Promise<void> {
  takes++;
  await viewer.settle();
  await viewer.screenshot(`film-${reel}-${String(takes).padStart(2, '0')}-${what}`);
}

const button = (name: string | RegExp): Locator =>
  viewer.page.getByRole('button', { name, ...(typeof name === 'string' ? { exact: true } : {}) });
const tab = (name: string): Locator => viewer.page.getByRole('tab', { name });
const liveIsReady = async (): Promise<void> => {
  await viewer.page.getByRole('radiogroup', { name: 'Tool' }).waitFor();
  await viewer.page.getByTestId('live-note').waitFor({ state: 'detached' });
  await viewer.page.getByTestId('totals').waitFor();
};

/** What is open is what a tick accepts: until the last changes are computed that is more. */
const figuresAreKnown = async (): Promise<void> =>
  viewer.page.getByText('Figures of the last changes are still being computed').waitFor({ state: 'detached' });

async function isSigned(by: string): Promise<void> {
  await expect.poll(async () => (await viewer.review()).sign_off?.name).toBe(by);
  const { stations, comments, verdicts } = await viewer.review();
  expect(stations[first.id].position_m).not.toBeNull();
  expect(Object.values(comments).map(({ author, target }) => [author, target])).toContainEqual([by, second.id]);
  expect(Object.keys(verdicts)).toHaveLength(plan.stations.length);
}

test('by fingers alone, on a tablet', async () => {
  viewer = await openPage({ hasTouch: true });
  const { page } = viewer;
  await viewer.open();
  await film('touch', 'opened');
  await page.locator(`[data-floor="${floor.id}"]`).first().tap();
  await button('Top').tap();
  await film('touch', 'floor');
  await viewer.marker(second.id).tap();
  await film('touch', 'station');
  await tab('Unseen').tap();
  await page.locator('.unseen button').first().tap();
  await film('touch', 'unseen');
  await tab('Network').tap();
  await film('touch', 'network');
  await tab('Edit').tap();
  await liveIsReady();
  await button('Top').tap();
  await viewer.settle();
  const [x, y] = await viewer.centreOf(first.id);
  await viewer.touch('touchStart', [x, y]);
  for (let i = 1; i <= 4; i++) await viewer.touch('touchMove', [x - 9 * i, y + 7 * i]);
  await film('touch', 'dragging');
  await viewer.touch('touchEnd');
  await expect.poll(async () => (await viewer.review()).stations[first.id]?.position_m ?? null).not.toBeNull();
  await film('touch', 'moved');
  await tab('Review').tap();
  await page.getByLabel('Your name, for changes and comments').tap();
  await page.keyboard.insertText('Ada');
  await viewer.marker(second.id).tap();
  await button(`Pin to ${second.id}`).tap();
  await page.getByLabel('New comment').tap();
  await page.keyboard.insertText('The door beside it is mostly shut.');
  await film('touch', 'comment');
  await button('Comment').tap();
  await expect.poll(async () => Object.keys((await viewer.review()).comments)).toHaveLength(1);
  await button(`Accept ${first.id}`).tap();
  await button(/^Accept the other/).tap();
  await expect.poll(async () => Object.keys((await viewer.review()).verdicts)).toHaveLength(plan.stations.length);
  await film('touch', 'verdicts');
  await figuresAreKnown();
  await page.getByLabel(/^Sign off with th/).tap();
  await film('touch', 'open-points');
  await button('Sign off as Ada').tap();
  await page.getByTestId('signature').waitFor();
  await film('touch', 'signed');
  await isSigned('Ada');
});

test('by keys alone', async () => {
  viewer = await openPage();
  const { page } = viewer;
  const { keyboard } = page;
  /** Tab until it has the focus, which has to be seen: where it lies in the page, and that something marks it. */
  const reach = async (target: Locator, by = 'Tab'): Promise<void> => {
    for (let n = 0; n < 250; n++) {
      if (await target.evaluate((one) => one === document.activeElement)) {
        expect(await target.evaluate(whyUnmarked)).toBe('');
        return;
      }
      await keyboard.press(by);
    }
    throw new Error(`no way by ${by} to ${target}`);
  };
  const use = async (target: Locator, by = 'Tab'): Promise<void> => {
    await reach(target, by);
    await keyboard.press('Enter');
    await viewer.settle();
  };
  /** The tabs are one stop; arrows go through them. */
  const openTab = async (name: string): Promise<void> => {
    await reach(page.locator('[role=tab][aria-selected=true]'), 'Shift+Tab');
    for (let n = 0; n < 6 && (await tab(name).getAttribute('aria-selected')) !== 'true'; n++) {
      await keyboard.press('ArrowRight');
    }
    await expect.poll(() => tab(name).getAttribute('aria-selected')).toBe('true');
  };
  await viewer.open();
  await film('keys', 'opened');
  await keyboard.press('1');
  await keyboard.press('t');
  await film('keys', 'floor');
  await use(viewer.marker(second.id));
  await film('keys', 'station');
  await openTab('Unseen');
  await use(page.locator('.unseen button').first());
  await film('keys', 'unseen');
  await openTab('Network');
  await film('keys', 'network');
  await openTab('Edit');
  await liveIsReady();
  await use(page.getByRole('radio', { name: 'Move', exact: true }));
  await keyboard.press('t');
  await viewer.settle();
  await use(viewer.marker(first.id));
  await keyboard.press('t');
  await viewer.settle();
  await keyboard.down('Shift');
  for (const key of ['ArrowDown', 'ArrowDown', 'ArrowLeft']) {
    await keyboard.press(key);
    await viewer.settle();
  }
  await film('keys', 'moving');
  await keyboard.up('Shift');
  await expect.poll(async () => (await viewer.review()).stations[first.id]?.position_m ?? null).not.toBeNull();
  await film('keys', 'moved');
  // A place is pointed at with the cross: here one that no station may come near.
  await use(page.getByRole('radio', { name: 'Forbid position', exact: true }), 'Shift+Tab');
  await reach(page.locator('canvas').first());
  for (let i = 0; i < 6; i++) await keyboard.press('ArrowDown');
  await film('keys', 'cross');
  await keyboard.press('Space');
  await expect.poll(async () => Object.keys((await viewer.review()).forbidden)).toHaveLength(1);
  await film('keys', 'forbidden');
  await keyboard.press('Control+z');
  await expect.poll(async () => Object.keys((await viewer.review()).forbidden)).toHaveLength(0);
  await keyboard.press('t');
  await viewer.settle();
  await use(viewer.marker(second.id));
  await openTab('Review');
  await reach(page.getByLabel('Your name, for changes and comments'));
  await keyboard.type('Ben');
  await use(button(`Pin to ${second.id}`));
  await reach(page.getByLabel('New comment'), 'Shift+Tab');
  await keyboard.type('Mind the step.');
  await film('keys', 'comment');
  await use(button('Comment'));
  await expect.poll(async () => Object.keys((await viewer.review()).comments)).toHaveLength(1);
  await use(button(`Accept ${first.id}`));
  await use(button(/^Accept the other/));
  await expect.poll(async () => Object.keys((await viewer.review()).verdicts)).toHaveLength(plan.stations.length);
  await film('keys', 'verdicts');
  await figuresAreKnown();
  await reach(page.getByLabel(/^Sign off with th/));
  await keyboard.press('Space');
  await film('keys', 'open-points');
  await use(button('Sign off as Ben'));
  await page.getByTestId('signature').waitFor();
  await film('keys', 'signed');
  await isSigned('Ben');
});

/** Why what has the focus is not seen to have it: it lies beyond the window, or nothing is around it. Empty: it is seen. */
function whyUnmarked(one: Element): string {
  const { x, y, width, height } = one.getBoundingClientRect();
  const isInside = x + width > 0 && y + height > 0 && x < window.innerWidth && y < window.innerHeight;
  if (!isInside) return `${one.outerHTML.slice(0, 120)} at ${[x, y, width, height]}`;
  const looks = [one, one.parentElement!].map((each) => getComputedStyle(each));
  const ringed = looks.some(({ outlineStyle, outlineWidth }) => outlineStyle !== 'none' && outlineWidth !== '0px');
  return ringed ? '' : `${one.outerHTML.slice(0, 120)}: no outline, focus-visible ${one.matches(':focus-visible')}`;
}
