/** Reviewing in real browsers: comments, the edited plan; two people at once; a server that is killed. */
import { expect, inject, test } from 'vitest';
import type { Change } from '../src/api/documents.ts';
import { type PagePoint, type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';
import { serveCopy, servePlan } from './plan-server.ts';

const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const [first] = plan.stations;
const openPage = viewerPages({ width: 900, height: 640 });

async function openAs(name: string, hash = '#tab=review', address = inject('address')): Promise<ViewerPage> {
  const viewer = await openPage({}, address);
  await viewer.open(hash);
  await viewer.page.getByLabel('Your name, for changes and comments').fill(name);
  return viewer;
}

test('comments are pinned to stations and surfaces, shown as text, and resolved', async () => {
  const viewer = await openAs('Ada', `#tab=review&floor=${first.floor}`);
  const { page } = viewer;
  const text = page.getByLabel('New comment');
  const post = page.getByRole('button', { name: 'Comment', exact: true });
  await text.fill('<img src=x onerror="document.title=1"> too near to the *door*');
  // What is being typed stays where one looks something up.
  await page.getByRole('tab', { name: 'Network' }).click();
  await page.getByRole('tab', { name: 'Review' }).click();
  await page.locator(`.marker[data-station="${first.id}"]`).click();
  await page.getByRole('button', { name: `Pin to ${first.id}`, exact: true }).click();
  await post.click();
  const entry = page.locator('[data-comment]').first();
  await entry.waitFor();
  await expect.poll(() => entry.textContent()).toContain('<img src=x onerror="document.title=1"> too near');
  await expect.poll(() => entry.locator('img').count()).toBe(0);
  expect(Object.values((await viewer.review()).comments)[0]).toMatchObject({ author: 'Ada', target: first.id });
  await entry.getByRole('button', { name: 'Assign' }).click();
  await entry.getByLabel('For', { exact: true }).fill('Kim');
  await entry.getByLabel('Due').fill('2020-02-29');
  await entry.getByRole('button', { name: 'Save' }).click();
  await expect.poll(() => entry.textContent()).toContain('for Kimoverdue since 29 Feb 2020');
  expect(Object.values((await viewer.review()).comments)[0]).toMatchObject({ assignee: 'Kim', due: '2020-02-29' });

  await page.getByRole('button', { name: 'Pin to a surface' }).click();
  const canvas = (await page.locator('canvas').first().boundingBox())!;
  // From above, a floor: not what lies over the picture, nor the cut through a wall.
  await viewer.press('t');
  for (const [dx, dy] of [
    [40, 40],
    [40, -40],
    [90, 20],
    [-40, 40],
    [-90, 20],
  ]) {
    const [x, y] = [canvas.x + canvas.width / 2 + dx, canvas.y + canvas.height / 2 + dy];
    if (!(await viewer.isBare(x, y))) continue;
    await page.mouse.click(x, y);
    break;
  }
  await page.getByText(/^On (?!the plan|site)/).waitFor();
  await text.fill('Is this wall still there?');
  await post.click();
  await expect.poll(() => page.locator('[data-comment]').count()).toBe(2);
  const pinned = Object.values((await viewer.review()).comments).find(({ target }) => typeof target === 'number');
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
  await expect.poll(() => post.isDisabled()).toBe(true);
  send();
  await page.getByText('First', { exact: true }).waitFor();
  await page.unroute('**/api/review/changes');
  await expect.poll(() => text.inputValue()).toBe('Second');

  await page.getByRole('button', { name: 'Resolve' }).first().click();
  await expect
    .poll(async () => Object.values((await viewer.review()).comments).some(({ resolved }) => resolved))
    .toBe(true);
});

test('the edited plan stands beside the plan, in words, and what is unseen follows it', async () => {
  const viewer = await openAs('Ada');
  const { page } = viewer;
  await page.waitForFunction(async () => (await (await fetch('api/session')).json()).live.state === 'ready', null, {
    timeout: 240_000,
  });
  const removed = plan.stations.filter((station) => station.floor === first.floor).slice(0, 3);
  const remove = removed.map(({ id }): Change => ({ kind: 'remove_station', station: id }));
  expect(await viewer.changeAs('Grace', ...remove)).toBe(200);
  await page.getByRole('tab', { name: 'Plan' }).click();
  const requirements = page.getByTestId('requirements');
  await expect.poll(() => requirements.textContent()).toContain('NOT MET');
  const row = requirements.locator('tr', { hasText: 'Stations' });
  await expect
    .poll(() => row.locator('td').allTextContents())
    .toEqual([`${plan.stations.length}`, `${plan.stations.length - removed.length}`]);
  await expect.poll(() => requirements.locator('thead').textContent()).toBe('as plannedas edited');
  await expect
    .poll(() => page.getByTestId('station-count').textContent())
    .toBe(`${plan.stations.length - removed.length}`);
  await expect.poll(() => page.getByTestId('met').textContent()).toMatch(/^Requirements\d of \d NOT MET$/);
  await viewer.screenshot('review-4-beside');

  const leftM2 = async (reason: string): Promise<number> => {
    const text = await page.getByRole('button', { name: reason }).locator('.row-area').textContent();
    return Number(/[\d.]+/.exec(text ?? '')?.[0]);
  };
  await page.getByRole('tab', { name: 'Unseen' }).click();
  await expect.poll(() => page.getByTestId('unseen-of').textContent()).toMatch(/^Of the edited plan/);
  const edited = await leftM2('left unseen by edits');
  await page.getByRole('radio', { name: 'As planned' }).click();
  await expect.poll(() => page.getByTestId('unseen-of').count()).toBe(0);
  await expect.poll(() => leftM2('reachable, left out')).toBeLessThan(edited);
  await page.getByRole('radio', { name: /^Edited/ }).click();

  await page.locator('.unseen > button').first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await page.getByRole('button', { name: 'left unseen by edits' }).click();
  await page.locator('.unseen > button').first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await expect.poll(() => page.getByTestId('legend').textContent()).toContain('left unseen by edits');
  await viewer.settle();
  await viewer.screenshot('review-5-unseen');
  await page.goto('about:blank');
  await viewer.open('#tab=runs&layer=difference&compare=');
  await page.getByRole('list', { name: 'Stations that differ' }).waitFor();
  await expect.poll(() => page.getByTestId('legend').textContent()).toContain('3 stations only in the other plan');
});

/** A point on the canvas, beside a station of the first floor, where a click finds ground. */
async function groundBeside(viewer: ViewerPage): Promise<PagePoint> {
  const { page } = viewer;
  for (const { id } of plan.stations.filter((station) => station.floor === first.floor)) {
    const [x, y] = await viewer.centreOf(id);
    const at: PagePoint = [x + 24, y + 24];
    if (!(await viewer.isBare(...at))) continue;
    await page.mouse.click(...at);
    const figures = page.getByTestId('surface-figures');
    const isGround = (await figures.count()) > 0 && (await figures.textContent())?.includes('Walkable floor');
    const closer = page.getByRole('button', { name: 'Close', exact: true });
    if ((await closer.count()) > 0) await closer.first().click();
    if (isGround) return at;
  }
  throw new Error('no ground beside any station of the first floor');
}

test('a floor that is ground already is not marked again, and marks leave the colours as they are', async () => {
  const viewer = await openAs('Ada', `#tab=edit&floor=${first.floor}`);
  const { page } = viewer;
  const count = async (): Promise<number> => Object.keys((await viewer.review()).ground_picks).length;
  await page.getByRole('button', { name: 'Top', exact: true }).click();
  await viewer.settle();
  const at = await groundBeside(viewer);
  await page.getByRole('radio', { name: 'Floor surface' }).click();
  await page.mouse.click(...at);
  await page.getByText(/^Already a walkable floor/).waitFor();
  await expect.poll(count).toBe(0);
  await page.getByRole('tab', { name: 'Unseen' }).click();
  await viewer.settle();
  const before = await viewer.canvasPixels();
  await page.getByRole('tab', { name: 'Edit' }).click();
  await page.getByRole('radio', { name: 'Not a floor' }).click();
  await viewer.settle();
  const plain = await viewer.canvasPixels();
  await page.mouse.click(...at);
  await page.getByRole('alertdialog').getByRole('button', { name: 'Not a floor' }).click();
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
});

test('two people who change the same station learn of each other, and neither loses anything', async () => {
  const ada = await openAs('Ada', '#tab=edit');
  const grace = await openAs('Grace', '#tab=review');
  const { id } = plan.stations[2];
  // Ada's page does not hear of it: as if both had changed it at the same moment.
  await ada.page.route('**/api/review', (route) => route.abort());
  await ada.page.getByRole('tab', { name: 'Review' }).click();
  expect(await grace.changeAs('Grace', { kind: 'set_verdict', station: id, verdict: 'rejected' })).toBe(200);
  await ada.page.getByRole('button', { name: `Reject ${id}`, exact: true }).click();
  await ada.page.getByRole('alertdialog').waitFor();
  await expect
    .poll(() => ada.page.getByRole('alertdialog').textContent())
    .toMatch(new RegExp(`Grace changed the verdict on station ${id} on \\d+ \\w+ \\d{4} at \\d\\d:\\d\\d`));
  await ada.screenshot('review-3-conflict');
  expect((await grace.review()).verdicts[id].by).toBe('Grace');
  await ada.page.getByRole('button', { name: 'Keep mine' }).click();
  await expect.poll(async () => (await grace.review()).verdicts[id].by).toBe('Ada');
  // What one commits shows on the other's page without asking.
  await grace.page.getByText('rejected by Ada').first().waitFor();
  ada.faults.splice(0);
});

test('a server that is killed has lost nothing it has answered', async () => {
  const server = await serveCopy(planFolder, inject('scene'));
  const viewer = await openAs('Ada', '#tab=review', server.address);
  const { page } = viewer;
  const text = page.getByLabel('New comment');
  const post = page.getByRole('button', { name: 'Comment', exact: true });
  await text.fill('Before the power went');
  await post.click();
  await page.getByText('Before the power went', { exact: true }).waitFor();
  const before = await viewer.review();
  await server.stop('SIGKILL');
  await page.getByTestId('trouble').getByText('The server does not answer').waitFor();
  await text.fill('While it was away');
  await post.click();
  await expect.poll(() => post.isEnabled()).toBe(true);
  await page.getByRole('alert').waitFor();
  // What could not be sent is still there to be sent again.
  await expect.poll(() => text.inputValue()).toBe('While it was away');
  viewer.faults.splice(0);
  await page.close();
  const again = await servePlan(server.folder, inject('scene'));
  const later = await openAs('Ada', '#tab=review', again.address);
  expect(await later.review()).toEqual(before);
  await later.page.getByText('Before the power went', { exact: true }).waitFor();
  await later.page.close();
  await again.stop();
  await server.stop(); // it removes the copy
});
