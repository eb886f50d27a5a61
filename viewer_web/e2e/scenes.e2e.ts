/**
 * The viewer on plans of real scenes, what it is for once through: see, judge, pick, move, plan again, decide.
 *
 * `TLSPLAN_E2E_SCENES` names the folder that has the plan folders; `make e2e-scenes` makes those of a duplex and of a synthetic
 * school. What a test found out about time and memory is for the record: test-results/scene-<name>.json.
 */
import { existsSync, mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { loadavg } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import type { Browser, Locator } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from 'vitest';
import type { Change, Review, Run } from '../src/api/documents.ts';
import { ViewerPage } from './browser.ts';
import { launchBrowser } from './chromium.ts';
import { countGl, type GlCount, glCount } from './gl-meter.ts';
import { PlanFiles } from './plan-files.ts';
import { type PlanServer, serveCopy } from './plan-server.ts';

const RESULTS = fileURLToPath(new URL('../test-results/', import.meta.url));
const SCENES = process.env.TLSPLAN_E2E_SCENES ?? '';
const names = (existsSync(SCENES) ? readdirSync(SCENES) : []).filter((name) =>
  existsSync(join(SCENES, name, 'plan.json')),
);
if (names.length === 0) throw new Error(`no plan folders in TLSPLAN_E2E_SCENES (${SCENES}): run make e2e-scenes`);

const LOADS = 3;
/** An answer of the live side, a picture of millions of points: on a busy machine these take their time. */
const SLOW = { timeout: 240_000 };
/** Candidates, scans and reasons of a school, or opening it for edits, take many minutes on two cores that others use as well. */
const RUN = { timeout: 2_400_000 };
/** What shows through other things is paler. */
const isPurple = ([r, g, b]: readonly number[]): boolean => b > g + 20 && r > g + 10;

describe.each(names)('%s', (name) => {
  const files = new PlanFiles(join(SCENES, name));
  const { plan } = files;
  const nOn = (floorId: string): number => plan.stations.filter(({ floor }) => floor === floorId).length;
  const [floor] = [...plan.floors].sort((a, b) => nOn(b.id) - nOn(a.id));
  const stations = plan.stations.filter((station) => station.floor === floor.id);
  const figures: Record<string, unknown> = { load_average_before: loadavg()[0] };
  const shot = (title: string): Promise<void> => viewer.screenshot(`scene-${name}-${title}`);

  let browser: Browser;
  let server: PlanServer;
  let viewer: ViewerPage;
  beforeAll(async () => {
    browser = await launchBrowser();
    server = await serveCopy(join(SCENES, name));
  });
  afterAll(async () => {
    await browser.close();
    await server.stop();
    figures.load_average_after = loadavg()[0];
    mkdirSync(RESULTS, { recursive: true });
    writeFileSync(join(RESULTS, `scene-${name}.json`), `${JSON.stringify(figures, null, 1)}\n`);
  });
  beforeEach(async () => {
    viewer = await ViewerPage.create(browser, server.address, { width: 1280, height: 800 });
    viewer.page.setDefaultTimeout(SLOW.timeout);
    await countGl(viewer.page);
  });
  afterEach(async () => {
    await viewer.page.close();
    expect(viewer.faults).toEqual([]);
  });

  const marker = (id: string): Locator => viewer.page.locator(`.marker[data-station="${id}"]`);
  const tab = (title: string): Promise<void> => viewer.page.getByRole('tab', { name: title }).click();
  const legendShown = (): Promise<void> => viewer.page.locator('[data-testid=legend][data-state=shown]').waitFor();
  const review = (): Promise<Review> => viewer.page.evaluate(async () => (await fetch('api/review')).json());
  const runs = (): Promise<Run[]> => viewer.page.evaluate(async () => (await (await fetch('api/runs')).json()).runs);

  async function changedFrom(revision: number): Promise<Review> {
    await expect.poll(async () => (await review()).revision, SLOW).not.toBe(revision);
    return review();
  }
  /** Changes go to the server one by one, as by hand. */
  async function change(...changes: readonly Change[]): Promise<number> {
    const { revision } = await review();
    return viewer.page.evaluate(
      async (body) => {
        const headers = { 'content-type': 'application/json' };
        return (await fetch('api/review/changes', { method: 'POST', headers, body: JSON.stringify(body) })).status;
      },
      { base_revision: revision, author: 'Grace', changes },
    );
  }

  test('it opens, its floors and layers have pictures of their own', async () => {
    const loads: number[] = [];
    for (let i = 0; i < LOADS; i++) {
      // A page of its own has an empty cache.
      const fresh = await ViewerPage.create(browser, server.address, { width: 1280, height: 800 });
      const start = performance.now();
      await fresh.open();
      loads.push(performance.now() - start);
      figures.transferred_bytes = await fresh.page.evaluate(() =>
        performance
          .getEntriesByType('resource')
          .reduce((sum, entry) => sum + (entry as PerformanceResourceTiming).transferSize, 0),
      );
      await fresh.page.close();
    }
    figures.load_ms = loads;
    await viewer.open();
    figures.building = await glCount(viewer.page);
    await shot('1-opened');
    let before = await viewer.canvasPixels();
    await viewer.page.locator(`[data-floor="${floor.id}"]`).click();
    await viewer.settle();
    for (const id of ['seen', ...files.layers.layers.map((layer) => layer.id), 'reason']) {
      await viewer.page.getByLabel('Colour of the building').selectOption(id);
      await legendShown();
      await viewer.settle();
      const after = await viewer.canvasPixels();
      expect(before.shareChanged(after), id).toBeGreaterThan(0.01);
      before = after;
      await shot(`1-layer-${id}`);
    }
    await viewer.page.getByLabel('Colour of the building').selectOption('times_seen');
    await viewer.page.keyboard.press('t');
    await viewer.settle();
    await shot('1-from-above');
    // Floors above each other: their stations stand at one spot, or nearly.
    await viewer.page.locator('[data-floor="all"]').click();
    await viewer.page.getByLabel('Spread floors apart').uncheck();
    await viewer.page.getByRole('button', { name: 'Top', exact: true }).click();
    await viewer.settle();
    await expect.poll(coveredNumbers).toEqual([]);
    await shot('1-whole-from-above');
  });

  /** Stations whose number another one covers. */
  const coveredNumbers = (): Promise<(string | undefined)[]> =>
    viewer.page.locator('.marker:not([hidden])').evaluateAll((all) =>
      (all as HTMLElement[])
        .filter((own) => {
          const { x, y, width, height } = own.getBoundingClientRect();
          const over = document.elementFromPoint(x + width / 2, y + height / 2)?.closest('.marker') ?? own;
          return over !== own;
        })
        .map((own) => own.dataset.station),
    );

  test('what is unseen is listed, flown to and pointed out', async () => {
    await viewer.open(`#tab=unseen&floor=${floor.id}`);
    await viewer.page.getByRole('button', { name: /reachable, left out/ }).click();
    await viewer.page.locator('.unseen > button').first().click();
    await legendShown();
    await viewer.settle();
    expect((await viewer.canvasPixels()).share(isPurple)).toBeGreaterThan(0.001);
    await shot('2-unseen');
  });

  test('a station shows its cloud, its panorama and its number on the route', async () => {
    const [station] = [...stations].sort((a, b) => b.covered_area_m2 - a.covered_area_m2);
    await viewer.open(`#floor=${floor.id}&station=${station.id}`);
    const { page } = viewer;
    await page.locator('[data-testid=cloud][data-state=shown]').waitFor();
    await viewer.settle();
    await shot('3-station');
    await page.getByRole('button', { name: 'Panorama' }).click();
    await page.getByRole('img', { name: `Panorama of station ${station.id}` }).waitFor();
    await viewer.settle();
    await shot('3-panorama');
    await page.keyboard.press('Escape');
    await page.getByRole('button', { name: 'View from here' }).click();
    await viewer.settle();
    await shot('3-inside');
    await page.keyboard.press('Escape');
    await page.getByText('Show route').click();
    await page.getByRole('button', { name: 'Next ›' }).click();
    await expect.poll(() => page.locator('.route-steps').textContent()).toContain(`of ${plan.route!.order.length}`);
  });

  test('a pair of stations shows what both see', async () => {
    const here = plan.registration.links.filter(({ a }) => stations.some(({ id }) => id === a));
    const [link] = [...here].sort((a, b) => b.overlap - a.overlap);
    await viewer.open(`#tab=network&floor=${floor.id}`);
    await expect.poll(() => viewer.page.locator('.graph-node').count()).toBe(plan.stations.length);
    await shot('4-network');
    await viewer.page
      .locator('.row-link')
      .filter({ hasText: `${link.a} – ${link.b}` })
      .first()
      .click();
    await legendShown();
    await viewer.settle();
    expect((await viewer.canvasPixels()).share(isPurple)).toBeGreaterThan(0.005);
    await shot('4-pair');
  });

  async function openEditing(): Promise<void> {
    await viewer.open(`#floor=${floor.id}&tab=edit`);
    await viewer.page.getByTestId('live-note').waitFor({ state: 'detached', ...RUN });
    await viewer.page.getByTestId('totals').waitFor();
    await viewer.page.keyboard.press('t');
    await viewer.settle();
    await viewer.page.mouse.move(800, 440);
    await viewer.page.mouse.wheel(0, -350);
    await viewer.settle();
  }
  const totals = (): Promise<string | null> => viewer.page.getByTestId('totals').textContent();

  /** A station whose marker nothing covers, in the middle of the picture rather than at its rim. */
  async function stationToDrag(): Promise<{ id: string; x: number; y: number }> {
    const found: { id: string; x: number; y: number; far: number }[] = [];
    for (const { id } of stations) {
      const box = await marker(id).boundingBox();
      if (box === null) continue;
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      const isOnTop = await marker(id).evaluate(
        (own, { x, y }) => document.elementFromPoint(x, y)?.closest('.marker') === own,
        { x, y },
      );
      if (isOnTop) found.push({ id, x, y, far: Math.hypot(x - 800, y - 440) });
    }
    return found.sort((a, b) => a.far - b.far)[0];
  }

  test('a dragged station moves the figures along, and goes back', async () => {
    await openEditing();
    const { page } = viewer;
    const before = await totals();
    const { revision } = await review();
    const { id, x, y } = await stationToDrag();
    await page.mouse.move(x, y);
    await page.mouse.down();
    // Walls may stop it in one direction or another: all around, further out each time.
    for (let i = 1; i <= 36 && (i <= 12 || (await totals()) === before); i++) {
      const [reach, angle] = [7 * Math.min(i, 12), 0.5 + 2.1 * Math.floor((i - 1) / 12)];
      await page.mouse.move(x + reach * Math.cos(angle), y + reach * Math.sin(angle));
      await viewer.settle();
    }
    await expect.poll(totals, SLOW).not.toBe(before);
    await shot('5-dragging');
    await page.mouse.up();
    const edited = await changedFrom(revision);
    expect(edited.stations[id].position_m).not.toBeNull();
    await viewer.settle();
    await shot('5-dragged');
    const bar = page.getByTestId('draft-bar');
    for (const what of ['answered', 'drawn']) {
      figures[`previews_${what}_ms`] = ((await bar.getAttribute(`data-${what}-ms`)) ?? '').split(' ').map(Number);
    }
    await tab('Runs');
    await page.getByLabel('The edited plan compared with').selectOption('');
    await page.getByTestId('comparison').waitFor();
    await expect.poll(() => page.locator('.legend').textContent(), SLOW).toContain('gained');
    await viewer.settle();
    await shot('5-compared');
    await page.getByLabel('The edited plan compared with').selectOption('(nothing)');
    await tab('Edit');
    await page.keyboard.press('Control+z');
    await expect.poll(async () => (await review()).stations[id]?.position_m ?? null, SLOW).toBeNull();
    await expect.poll(totals, SLOW).toBe(before);
  });

  test('ground is unmarked where it is clicked, and marked again', async () => {
    await openEditing();
    const { page } = viewer;
    const { revision } = await review();
    const { x, y } = await stationToDrag();
    await page.getByRole('radio', { name: 'Floor surface' }).click();
    await page.getByRole('radio', { name: 'Not a floor' }).click();
    // What stands around a station may be furniture.
    const around = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [
      26 * Math.cos((i * Math.PI) / 4),
      26 * Math.sin((i * Math.PI) / 4),
    ]);
    for (const [dx, dy] of around) {
      await page.mouse.click(x + dx, y + dy);
      const refused = page.getByText(/nothing to unmark/);
      const yes = page.getByRole('alertdialog').getByRole('button', { name: 'Not a floor' });
      await expect
        .poll(async () => {
          if ((await yes.count()) > 0) await yes.click();
          return (await review()).revision > revision || (await refused.count()) > 0;
        }, SLOW)
        .toBe(true);
      if ((await review()).revision > revision) break;
      await page.getByRole('button', { name: 'Dismiss' }).click();
    }
    const picked = await changedFrom(revision);
    expect(Object.values(picked.ground_picks)).toMatchObject([{ is_ground: false, floor: floor.id }]);
    await viewer.settle();
    await shot('6-ground');
    await page.keyboard.press('Control+z');
    await expect.poll(async () => Object.keys((await review()).ground_picks).length, SLOW).toBe(0);
  });

  test('it is planned again from the browser, and the run ends as it says', async () => {
    await viewer.open('#tab=runs');
    const { page } = viewer;
    const card = page.locator('[data-run]').first();
    await page.getByRole('textbox', { name: 'Title' }).fill('Less of it');
    await page.getByRole('textbox', { name: /^Coverage/ }).fill('80');
    await page.getByText('More requirements').click();
    await page.getByRole('textbox', { name: /^Time limit/ }).fill('20');
    await page.getByRole('button', { name: 'Start' }).click();
    await card.waitFor();
    await expect.poll(async () => (await runs())[0].best?.n_stations ?? (await runs())[0].message, RUN).toBeTruthy();
    await card.scrollIntoViewIfNeeded();
    await viewer.settle();
    await shot('7-running');
    await expect.poll(() => card.getAttribute('data-state'), RUN).toBe('finished');
    await card.getByRole('button', { name: 'Compare' }).click();
    await page.getByTestId('comparison').waitFor();
    await expect.poll(() => page.locator('.legend').textContent(), SLOW).toContain('seen only in');
    await viewer.settle();
    await shot('7-compared');
  });

  test('it is commented, judged and signed', async () => {
    await viewer.open(`#tab=review&floor=${floor.id}`);
    const { page } = viewer;
    const [first, second, ...others] = plan.stations;
    await page.getByLabel('Your name, for changes and comments').fill('Ada');
    await marker(stations[0].id).click();
    await page.getByRole('button', { name: `Pin to ${stations[0].id}`, exact: true }).click();
    await page.getByLabel('New comment').fill('The door here stays shut until Friday.');
    await page.getByRole('button', { name: 'Comment', exact: true }).click();
    await page.locator('[data-comment]').first().waitFor();
    await page.keyboard.press('Escape');
    const verdicts = others.map(({ id }): Change => ({ kind: 'set_verdict', station: id, verdict: 'accepted' }));
    expect(await change(...verdicts)).toBe(200);
    await page.getByRole('button', { name: `Reject ${second.id}`, exact: true }).click();
    await page.getByRole('button', { name: `Accept ${first.id}`, exact: true }).click();
    await expect.poll(async () => Object.keys((await review()).verdicts).length, SLOW).toBe(plan.stations.length);
    await expect.poll(() => page.locator('.concerns').textContent()).toContain(second.id);
    await page.getByLabel(/^Sign off with these points open/).check();
    await shot('8-open-points');
    await page.getByRole('button', { name: 'Sign off as Ada' }).click();
    await page.getByTestId('signature').waitFor();
    await page.getByTestId('signature').scrollIntoViewIfNeeded();
    await shot('8-signed');
  });

  test('the server gives nothing to who has not its address, and parts of clouds to who has', async () => {
    await viewer.open();
    const { page } = viewer;
    const cloud = `plan/viewer/clouds/${plan.stations[0].id}.cloud`;
    const asked = await page.evaluate(async (url) => {
      const part = await fetch(url, { headers: { range: 'bytes=0-99' } });
      const outside = await fetch('plan/%2e%2e%2f%2e%2e%2fetc%2fpasswd');
      return { status: part.status, size: (await part.arrayBuffer()).byteLength, outside: outside.status };
    }, cloud);
    expect(asked).toEqual({ status: 206, size: 100, outside: 404 });
    const origin = new URL(page.url()).origin;
    expect((await fetch(`${origin}/${cloud}`)).status).toBe(401);
    expect((await fetch(`${origin}/api/review`)).status).toBe(401);
    // The browser notes the request that was refused.
    expect(viewer.faults.splice(0)).toEqual([expect.stringContaining('404')]);
  });

  test('on a dark tablet everything has its place', async () => {
    await viewer.page.close();
    viewer = await ViewerPage.create(browser, server.address, {
      width: 820,
      height: 1180,
      hasTouch: true,
      colorScheme: 'dark',
    });
    await viewer.open(`#floor=${floor.id}`);
    const outside = await viewer.page.evaluate(() =>
      [...document.querySelectorAll('.toolbar > *, .corner > *, .sidebar, .tabs button')]
        .filter((one) => one.getBoundingClientRect().right > window.innerWidth || one.getBoundingClientRect().left < 0)
        .map((one) => one.className),
    );
    expect(outside).toEqual([]);
    await shot('9-tablet');
  });

  /** How long pictures take while the building is turned. */
  async function frameMs(): Promise<number> {
    const { page } = viewer;
    const before = await glCount(page);
    const start = performance.now();
    await page.mouse.move(900, 400);
    await page.mouse.down();
    for (let i = 1; i <= 8; i++) {
      await page.mouse.move(900 + 4 * i, 400);
      await viewer.settle();
    }
    await page.mouse.up();
    await viewer.settle();
    return (performance.now() - start) / ((await glCount(page)).nPictures - before.nPictures);
  }

  test('clouds stay within their budget, and give their memory back when they are hidden', async () => {
    await viewer.open();
    const { page } = viewer;
    const before: GlCount = await glCount(page);
    const toggle = page.getByRole('button', { name: 'Clouds', exact: true });
    await toggle.click();
    // A picture of them is drawn with every cloud that comes.
    await page.locator('[data-testid=cloud][data-state=shown]').waitFor(RUN);
    await viewer.settle();
    const shown = await glCount(page);
    expect(shown.points).toBeGreaterThan(0);
    // A million more of what is looked at, where the live server is ready by then.
    expect(shown.points).toBeLessThanOrEqual(9_000_000);
    expect(shown.bytes - before.bytes).toBeGreaterThanOrEqual(3 * shown.points);
    figures.clouds = {
      n_stations: plan.stations.length,
      words: await page.getByTestId('cloud').locator('p').first().textContent(),
      frame_ms: await frameMs(),
      ...shown,
    };
    await page.getByLabel('Colour of the cloud').selectOption('station');
    await viewer.settle();
    await shot('10-clouds');
    await toggle.click();
    await expect.poll(async () => (await glCount(page)).bytes).toBeLessThan(before.bytes + 0.02 * shown.bytes);
    const hidden = await glCount(page);
    figures.hidden = { frame_ms: await frameMs(), ...hidden };

    await page.locator(`[data-floor="${floor.id}"]`).click();
    await viewer.settle();
    const floorAlone = await glCount(page);
    figures.floor_alone = floorAlone;
    if (plan.floors.length > 1) expect(floorAlone.triangles).toBeLessThan(hidden.triangles);
  });
});
