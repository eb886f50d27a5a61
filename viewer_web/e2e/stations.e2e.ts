/** Stations in the viewer: what requirements would lose without one, and which of them other floors hide. */
import { beforeEach, expect, inject, test } from 'vitest';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, floors, stationsOf } = new PlanFiles(inject('planFolder'));
const [ground, upper] = floors;
const openPage = viewerPages({ width: 960, height: 600 });
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await openPage();
});

const note = () => viewer.page.getByTestId('covered');

test('a card lists by requirement what would be lost without the station, and points it out', async () => {
  const station = stationsOf(upper.id)[0];
  await viewer.open(`#station=${station.id}`);
  const { page } = viewer;
  const rows = page.locator('.losses button');
  await expect.poll(() => rows.count()).toBe(station.losses?.length);
  for (const [i, loss] of (station.losses ?? []).entries()) {
    await rows.nth(i).click();
    await page.locator('[data-testid=legend][data-state=shown]').waitFor();
    await viewer.settle();
    const area = `${loss.area_m2.toFixed(loss.area_m2 < 0.05 ? 2 : 1)} m²`;
    await expect.poll(() => rows.nth(i).textContent()).toContain(`−${area}`);
    await expect
      .poll(() => rows.nth(i).textContent())
      .toMatch(loss.met ? /still met/ : /no longer met|not met either way/);
    await expect.poll(() => page.getByTestId('legend').textContent()).toContain(area);
    await expect.poll(() => rows.nth(i).getAttribute('aria-pressed')).toBe('true');
  }
  await viewer.screenshot('s-losses');
  await rows.last().click();
  await expect.poll(() => rows.last().getAttribute('aria-pressed')).toBe('false');
  await page.getByText('Range of returns').waitFor();
});

test('from above the stations that upper floors hide are counted, and their floor is a click away', async () => {
  await viewer.open();
  const { page } = viewer;
  await viewer.press('t');
  await note().waitFor();
  const [, n] = /^(\d+) stations? behind another floor/.exec((await note().textContent()) ?? '') ?? [];
  const shown = await page.locator('.marker:not([hidden])').count();
  expect(Number(n)).toBeGreaterThan(0);
  expect(Number(n) + shown).toBe(plan.stations.length);
  await viewer.screenshot('s-covered');
  await note()
    .getByRole('button', { name: `Open ${ground.name}` })
    .click();
  await note().waitFor({ state: 'detached' });
  await expect.poll(() => viewer.hash()).toContain(`floor=${ground.id}`);
  await expect.poll(() => page.locator('.marker:not([hidden])').count()).toBe(stationsOf(ground.id).length);
});

test('a chosen station behind an upper floor is marked through it, says so, and opens its floor', async () => {
  await viewer.open();
  const { page } = viewer;
  await viewer.press('t');
  await note().waitFor();
  const hidden = await page.locator('.marker[hidden]').first().getAttribute('data-station');
  await page.locator(`li [data-station=${hidden}]`).click();
  await viewer.settle();
  await page.locator('[data-floor=all]').click();
  await viewer.press('t');
  const mark = viewer.marker(hidden ?? '');
  await expect.poll(() => mark.getAttribute('class')).toContain('marker-through');
  await expect.poll(() => mark.isVisible()).toBe(true);
  await expect.poll(() => note().textContent()).toContain(`${hidden} is behind ${upper.name}`);
  await viewer.screenshot('s-through');
  await note()
    .getByRole('button', { name: `Open ${ground.name}` })
    .first()
    .click();
  await note().waitFor({ state: 'detached' });
  await expect.poll(() => mark.getAttribute('class')).not.toContain('marker-through');
  await expect.poll(() => viewer.hash()).toContain(`floor=${ground.id}&station=${hidden}`);
});

test('one looks around in the scan of a station, and steps to another that is in sight', async () => {
  const [first] = stationsOf(ground.id);
  await viewer.open(`#floor=${ground.id}&station=${first.id}`);
  const { page } = viewer;
  const pictureOf = (id: string) => page.getByLabel(`What station ${id} sees`);
  /** Share of the picture that is drawn, and a number that another picture hardly has. */
  const drawn = (id: string) =>
    pictureOf(id).evaluate((canvas: HTMLCanvasElement) => {
      const { data } = canvas.getContext('2d')!.getImageData(0, 0, canvas.width, canvas.height);
      const share = data.filter((value, i) => i % 4 === 3 && value > 0).length / (data.length / 4);
      return { share, sum: data.reduce((sum, value) => (31 * sum + value) % 1_000_003, 0) };
    });
  await page.getByRole('button', { name: 'Panorama' }).click();
  await page.getByRole('radio', { name: 'Look around' }).click();
  await expect.poll(async () => (await drawn(first.id)).share).toBeGreaterThan(0.5);
  const before = await drawn(first.id);
  const box = (await pictureOf(first.id).boundingBox())!;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  const words = page.locator('.panorama p');
  await expect.poll(() => words.textContent()).toMatch(/^(Range [\d.]+ m, incidence \d+°|No return)$/);
  await page.mouse.down();
  await page.mouse.move(x + 120, y + 10, { steps: 4 });
  await page.mouse.up();
  await expect.poll(async () => (await drawn(first.id)).sum).not.toBe(before.sum);
  // All around by keys: of the stations of a floor that is joined some are in sight.
  await pictureOf(first.id).focus();
  const others = page.locator('.look-station');
  for (let step = 0; step < 48 && (await others.count()) === 0; step++) await page.keyboard.press('ArrowRight');
  await expect.poll(() => viewer.hash()).toContain(`station=${first.id}`);
  await viewer.screenshot('s-look-around');
  const next = (await others.first().getAttribute('aria-label'))!.split(' ').pop()!;
  await others.first().click();
  await expect.poll(() => viewer.hash()).toContain(`station=${next}`);
  await expect.poll(async () => (await drawn(next)).share).toBeGreaterThan(0.5);
  await viewer.screenshot('s-look-around-next');
  await page.getByRole('radio', { name: 'All around' }).click();
  await page.getByRole('img', { name: `Panorama of station ${next}` }).waitFor();
});
