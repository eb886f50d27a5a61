/** Reviewing in real browsers: remarks, verdicts, sign-off; two people at once; a server that is killed. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, beforeAll, expect, inject, test } from 'vitest';
import type { Change, Review } from '../src/api/documents.ts';
import { addZone } from '../src/edit/changes.ts';
import { type PlanJson, parsePlan } from '../src/load/plan-json.ts';
import { addComment } from '../src/review/remarks.ts';
import { launchBrowser, ViewerPage } from './browser.ts';
import { type PlanServer, sceneOf, serveCopy, servePlan } from './plan-server.ts';

const planFolder = inject('planFolder');
const plan: PlanJson = parsePlan(JSON.parse(readFileSync(join(planFolder, 'plan.json'), 'utf8')));
const [first, second] = plan.stations;
const LOOK = { width: 900, height: 640 };

let browser: Browser;
let server: PlanServer;
beforeAll(async () => {
  browser = await launchBrowser();
  server = await serveCopy(planFolder);
});
afterAll(async () => {
  await browser.close();
  await server.stop();
});

async function openAs(name: string, hash = '#tab=review'): Promise<ViewerPage> {
  const viewer = await ViewerPage.create(browser, server.address, LOOK);
  await viewer.open(hash);
  await viewer.page.getByLabel('Your name, for changes and comments').fill(name);
  return viewer;
}
async function close(viewer: ViewerPage): Promise<void> {
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
}
const review = (viewer: ViewerPage): Promise<Review> =>
  viewer.page.evaluate(async () => (await fetch('api/review')).json());

/** Change the review behind the page's back, as another program would. */
async function changeAs(viewer: ViewerPage, author: string, ...changes: readonly Change[]): Promise<number> {
  const { revision } = await review(viewer);
  return viewer.page.evaluate(
    async (body) => {
      const headers = { 'content-type': 'application/json' };
      return (await fetch('api/review/changes', { method: 'POST', headers, body: JSON.stringify(body) })).status;
    },
    { base_revision: revision, author, changes },
  );
}

test('comments are pinned to stations and surfaces, shown as text, and resolved', async () => {
  const viewer = await openAs('Ada', `#tab=review&floor=${first.floor}`);
  const { page } = viewer;
  const text = page.getByLabel('New comment');
  const post = page.getByRole('button', { name: 'Comment', exact: true });
  await text.fill('<img src=x onerror="document.title=1"> too near to the *door*');
  await page.locator(`.marker[data-station="${first.id}"]`).click();
  await page.getByRole('button', { name: `Pin to ${first.id}`, exact: true }).click();
  await post.click();
  const entry = page.locator('[data-comment]').first();
  await entry.waitFor();
  expect(await entry.textContent()).toContain('<img src=x onerror="document.title=1"> too near');
  expect(await entry.locator('img').count()).toBe(0);
  expect(Object.values((await review(viewer)).comments)[0]).toMatchObject({ author: 'Ada', target: first.id });

  await page.getByRole('button', { name: 'Pin to a surface' }).click();
  const canvas = (await page.locator('canvas').first().boundingBox())!;
  // Beside the middle, where the chosen station stands, and beside its card.
  await page.mouse.click(canvas.x + canvas.width / 2 - 110, canvas.y + canvas.height / 2 - 30);
  await page.getByText(/^On (?!the plan)/).waitFor();
  await text.fill('Is this wall still there?');
  await post.click();
  await expect.poll(() => page.locator('[data-comment]').count()).toBe(2);
  const pinned = Object.values((await review(viewer)).comments).find(({ target }) => typeof target === 'number');
  expect(pinned?.position_m).toHaveLength(3);
  await viewer.screenshot('review-1-comments');

  // What is written while a comment is being sent is the next one.
  let send = (): void => undefined;
  const isHeld = new Promise<void>((held) => {
    void page.route('**/api/review/changes', async (route) => {
      held();
      await new Promise<void>((go) => {
        send = go;
      });
      await route.continue();
    });
  });
  await text.fill('First');
  await post.click();
  await isHeld;
  await text.fill('Second');
  expect(await post.isDisabled()).toBe(true);
  send();
  await page.getByText('First', { exact: true }).waitFor();
  await page.unroute('**/api/review/changes');
  expect(await text.inputValue()).toBe('Second');

  await page.getByRole('button', { name: 'Resolve' }).first().click();
  await expect
    .poll(async () => Object.values((await review(viewer)).comments).some(({ resolved }) => resolved))
    .toBe(true);
  await close(viewer);
});

test('stations are accepted and rejected, and the plan is signed off', { tags: 'main' }, async () => {
  const viewer = await openAs('Grace');
  const { page } = viewer;
  await page.getByRole('button', { name: `Accept ${first.id}`, exact: true }).click();
  await page.getByRole('button', { name: `Reject ${second.id}`, exact: true }).click();
  await expect.poll(async () => (await review(viewer)).verdicts[second.id]?.verdict).toBe('rejected');
  expect((await review(viewer)).verdicts[first.id]).toMatchObject({ verdict: 'accepted', by: 'Grace' });
  await page.getByRole('button', { name: /^Accept the other/ }).click();
  await expect.poll(async () => Object.keys((await review(viewer)).verdicts).length).toBe(plan.stations.length);
  const open = page.getByRole('list', { name: 'Open points' });
  expect(await open.textContent()).toContain(`${second.id} is rejected and still in the plan`);
  expect(await changeAs(viewer, 'Ada', addComment('And the cellar?', null, null))).toBe(200);
  await expect.poll(() => open.textContent()).toMatch(/comments? (is|are) open/);
  const signing = page.getByRole('button', { name: 'Sign off as Grace' });
  expect(await signing.isDisabled()).toBe(true);
  await page.getByLabel(/^Sign off with these points open/).check();
  await viewer.screenshot('review-2-open-points');
  // Who has agreed to some points is asked again when there are more.
  const { position } = plan.stations[2];
  const around = [
    [-0.5, -0.5],
    [0.5, -0.5],
    [0.5, 0.5],
    [-0.5, 0.5],
  ].map(([dx, dy]) => [position[0] + dx, position[1] + dy] as [number, number]);
  const { floor } = plan.stations[2];
  const zone = addZone({ kind: 'keep_out', outline: around, floor, name: '', coverage: null });
  expect(await changeAs(viewer, 'Ada', zone)).toBe(200);
  await expect.poll(() => open.textContent()).toContain('keep-out zone');
  expect(await signing.isDisabled()).toBe(true);
  await page.getByLabel(/^Sign off with these points open/).check();
  await signing.click();
  await page.getByTestId('signature').waitFor();
  expect(await page.getByTestId('signature').textContent()).toMatch(/Grace signed off at .*No changes since/);
  expect(await changeAs(viewer, 'Ada', { kind: 'lock_station', station: first.id, locked: true })).toBe(200);
  await expect.poll(() => page.getByTestId('signature').textContent()).toContain('1 change since');
  await viewer.screenshot('review-2-signed');
  await close(viewer);
});

test('the edited plan stands beside the plan, in words, and what is unseen follows it', async () => {
  const viewer = await openAs('Ada');
  const { page } = viewer;
  await page.waitForFunction(async () => (await (await fetch('api/session')).json()).live.state === 'ready', null, {
    timeout: 240_000,
  });
  const removed = plan.stations.filter((station) => station.floor === first.floor).slice(0, 3);
  const remove = removed.map(({ id }): Change => ({ kind: 'remove_station', station: id }));
  expect(await changeAs(viewer, 'Grace', ...remove)).toBe(200);
  await page.getByRole('tab', { name: 'Plan' }).click();
  const requirements = page.getByTestId('requirements');
  await expect.poll(() => requirements.textContent()).toContain('NOT MET');
  const row = requirements.locator('tr', { hasText: 'Stations' });
  expect(await row.locator('td').allTextContents()).toEqual([
    `${plan.stations.length}`,
    `${plan.stations.length - removed.length}`,
  ]);
  expect(await requirements.locator('thead').textContent()).toBe('as plannedas edited');
  expect(await page.getByTestId('station-count').textContent()).toBe(`${plan.stations.length - removed.length}`);
  await expect.poll(() => page.getByTestId('met').textContent()).toMatch(/^Requirements\d of \d NOT MET$/);
  await viewer.screenshot('review-4-beside');

  const leftM2 = async (reason: string): Promise<number> => {
    const text = await page.getByRole('button', { name: reason }).locator('.row-area').textContent();
    return Number(/[\d.]+/.exec(text ?? '')?.[0]);
  };
  await page.getByRole('tab', { name: 'Unseen' }).click();
  expect(await page.getByTestId('unseen-of').textContent()).toMatch(/^Of the edited plan/);
  const edited = await leftM2('left unseen by edits');
  await page.getByRole('radio', { name: 'As planned' }).click();
  expect(await page.getByTestId('unseen-of').count()).toBe(0);
  expect(await leftM2('reachable, left out')).toBeLessThan(edited);
  await page.getByRole('radio', { name: /^Edited/ }).click();

  await page.locator('.unseen > button').first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await page.getByRole('button', { name: 'left unseen by edits' }).click();
  await page.locator('.unseen > button').first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  expect(await page.getByTestId('legend').textContent()).toContain('left unseen by edits');
  await viewer.settle();
  await viewer.screenshot('review-5-unseen');
  await page.goto('about:blank');
  await viewer.open('#tab=runs&layer=difference&compare=');
  await page.getByRole('list', { name: 'Stations that differ' }).waitFor();
  await expect.poll(() => page.getByTestId('legend').textContent()).toContain('3 stations only in the other plan');
  const restore = removed.map(({ id }): Change => ({ kind: 'restore_station', station: id }));
  expect(await changeAs(viewer, 'Grace', ...restore)).toBe(200);
  await expect.poll(() => page.getByTestId('draft-bar').count()).toBe(0);
  await close(viewer);
});

/** A place on the canvas, beside a station of the first floor, where a click says that the surface is ground. */
async function groundBeside({ page }: ViewerPage): Promise<readonly [number, number]> {
  for (const { id } of plan.stations.filter((station) => station.floor === first.floor)) {
    const marker = (await page.locator(`.marker[data-station="${id}"]`).boundingBox())!;
    const at = [marker.x + marker.width / 2 + 24, marker.y + marker.height / 2 + 24] as const;
    const isBare = await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS', at);
    if (!isBare) continue;
    await page.mouse.click(...at);
    const told = page.getByTestId('surface-figures');
    const isGround = (await told.count()) > 0 && (await told.textContent())?.includes('Walkable floor');
    const closer = page.getByRole('button', { name: 'Close', exact: true });
    if ((await closer.count()) > 0) await closer.first().click();
    if (isGround) return at;
  }
  throw new Error('no ground beside any station of the first floor');
}

test('a floor that is ground already is not marked again, and marks leave the colours as they are', async () => {
  const viewer = await openAs('Ada', `#tab=edit&floor=${first.floor}`);
  const { page } = viewer;
  const count = async (): Promise<number> => Object.keys((await review(viewer)).ground_picks).length;
  await page.getByRole('button', { name: 'Top', exact: true }).click();
  await viewer.settle();
  const at = await groundBeside(viewer);
  await page.getByRole('radio', { name: 'Floor surface' }).click();
  await page.mouse.click(...at);
  await page.getByText(/^Already a walkable floor/).waitFor();
  expect(await count()).toBe(0);
  await page.getByRole('tab', { name: 'Unseen' }).click();
  await viewer.settle();
  const before = await viewer.canvasPixels();
  await page.getByRole('tab', { name: 'Edit' }).click();
  await page.getByRole('radio', { name: 'Not a floor' }).click();
  await viewer.settle();
  const plain = await viewer.canvasPixels();
  await page.mouse.click(...at);
  await expect.poll(count).toBe(1);
  const unmark = page.getByRole('button', { name: /^Unmark/ });
  await unmark.waitFor();
  await viewer.settle();
  const filled = plain.shareChanged(await viewer.canvasPixels());
  expect(filled).toBeGreaterThan(0.02);
  await page.getByRole('tab', { name: 'Unseen' }).click();
  await viewer.settle();
  // Its rim is all that is drawn.
  expect(before.shareChanged(await viewer.canvasPixels())).toBeLessThan(0.5 * filled);
  await viewer.screenshot('review-6-ground');
  await page.getByRole('tab', { name: 'Edit' }).click();
  await unmark.click();
  await expect.poll(count).toBe(0);
  await close(viewer);
});

test('two people who change the same station are told of each other, and neither loses anything', async () => {
  const ada = await openAs('Ada', '#tab=edit');
  const grace = await openAs('Grace', '#tab=review');
  const { id } = plan.stations[2];
  // Ada's page does not hear of it: as if both had changed it at the same moment.
  await ada.page.route('**/api/review', (route) => route.abort());
  await ada.page.getByRole('tab', { name: 'Review' }).click();
  expect(await changeAs(grace, 'Grace', { kind: 'set_verdict', station: id, verdict: 'rejected' })).toBe(200);
  await ada.page.getByRole('button', { name: `Reject ${id}`, exact: true }).click();
  await ada.page.getByRole('alertdialog').waitFor();
  expect(await ada.page.getByRole('alertdialog').textContent()).toMatch(
    new RegExp(`Grace changed the verdict on station ${id} at \\d\\d:\\d\\d`),
  );
  await ada.screenshot('review-3-conflict');
  expect((await review(grace)).verdicts[id].by).toBe('Grace');
  await ada.page.getByRole('button', { name: 'Keep mine' }).click();
  await expect.poll(async () => (await review(grace)).verdicts[id].by).toBe('Ada');
  // What one commits shows on the other's page without asking.
  await grace.page.getByText('rejected by Ada').first().waitFor();
  await close(grace);
  await ada.page.close();
});

test('a server that is killed has lost nothing it has answered', async () => {
  const viewer = await openAs('Ada', '#tab=review');
  await viewer.page.getByLabel('New comment').fill('Before the power went');
  await viewer.page.getByRole('button', { name: 'Comment', exact: true }).click();
  await viewer.page.getByText('Before the power went', { exact: true }).waitFor();
  const before = await review(viewer);
  await server.stop('SIGKILL');
  // A question that was under way is told of beside it.
  await viewer.page.getByTestId('trouble').getByText('The server does not answer').waitFor();
  await viewer.page.getByLabel('New comment').fill('While it was away');
  const post = viewer.page.getByRole('button', { name: 'Comment', exact: true });
  await post.click();
  await expect.poll(() => post.isEnabled()).toBe(true);
  await viewer.page.getByRole('alert').waitFor();
  // What could not be sent is still there to be sent again.
  expect(await viewer.page.getByLabel('New comment').inputValue()).toBe('While it was away');
  await viewer.page.close();
  const killed = server;
  const again = await servePlan(server.folder, sceneOf(planFolder));
  server = {
    ...again,
    stop: async () => {
      await again.stop();
      await killed.stop(); // it removes the copy
    },
  };
  const later = await openAs('Ada');
  expect(await review(later)).toEqual(before);
  await later.page.getByText('Before the power went', { exact: true }).waitFor();
  await close(later);
});
