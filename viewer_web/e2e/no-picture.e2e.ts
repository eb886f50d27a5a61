/** Browsers without WebGL, and those that lose it: the plan of a floor stands in the picture's place, and all else works. */
import { expect, inject, test } from 'vitest';
import { violations } from './axe.ts';
import { viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground, stationsOf } = new PlanFiles(inject('planFolder'));
const stations = stationsOf(ground.id);
const [station] = stations;
const openPage = viewerPages({ width: 1280, height: 800 });

test('without WebGL a plan is read, reviewed and taken along: what needs the picture is off, with the reason', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await page.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype as unknown as { getContext: (...args: unknown[]) => unknown };
    Object.assign(HTMLCanvasElement.prototype, {
      getContext(this: HTMLCanvasElement, kind: string, options?: object) {
        return /webgl/.test(kind) ? null : getContext.call(this, kind, options);
      },
    });
  });
  await viewer.open();
  await page.getByText('This browser shows no 3D picture').waitFor();
  await expect.poll(() => page.getByTestId('station-count').textContent()).toBe(String(plan.stations.length));
  await expect.poll(() => page.getByTestId('coverage').textContent()).toMatch(/^\d+\.\d %$/);
  await page.locator(`[data-floor="${ground.id}"]`).click();
  await expect.poll(() => viewer.shownStations()).toEqual(stations.map(({ id }) => id).sort());
  await expect.poll(() => page.locator('.flat-picture .map-walls').getAttribute('d')).toMatch(/^M.{1000}/);
  // Numbers stand in the plan where stations do, and go with it.
  await expectInPlan();
  await viewer.dragFrom([700, 700], 60, -40, 2);
  await page.mouse.up();
  await expectInPlan();
  for (const name of ['Walk', '3D', 'Clouds', 'Section']) {
    const button = page.getByRole('button', { name, exact: true });
    await expect.poll(() => button.isDisabled()).toBe(true);
    await expect.poll(() => button.getAttribute('title')).toContain('Needs the 3D picture');
  }

  await page.locator(`li [data-station="${station.id}"]`).click();
  await expect
    .poll(() => viewer.figures('station-figures'))
    .toMatchObject({
      x: `${station.position[0].toFixed(3)} m`,
      'Seen area': `${station.covered_area_m2.toFixed(1)} m²`,
    });
  expect(await violations(page)).toEqual([]);
  await page.getByLabel('Show route').check();
  await expect.poll(() => page.locator('.flat-picture .map-walk').count()).toBeGreaterThan(5);
  await page.getByLabel('Show route').uncheck();
  await viewer.screenshot('no-picture-1-station');
  await page.getByRole('button', { name: 'Share' }).click();
  await page.getByRole('button', { name: /^Station list\s*CSV$/ }).waitFor();
  await expect.poll(() => page.getByRole('button', { name: /^Picture/ }).isDisabled()).toBe(true);
  await page.keyboard.press('Escape');

  await page.getByRole('tab', { name: 'Network' }).click();
  await expect.poll(() => page.locator('.graph-node').count()).toBe(plan.stations.length);
  await page.getByRole('tab', { name: 'Review' }).click();
  await page.getByLabel('New comment').fill('Is the cupboard moved before?');
  await page.getByRole('button', { name: 'Comment', exact: true }).click();
  await page.getByRole('button', { name: `Accept ${station.id}`, exact: true }).click();
  await expect.poll(async () => (await viewer.review()).verdicts[station.id]?.verdict).toBe('accepted');
  await expect.poll(async () => Object.keys((await viewer.review()).comments)).toHaveLength(1);
  expect(await violations(page)).toEqual([]);
  await page.getByRole('button', { name: 'Field view' }).click();
  await page.getByRole('group', { name: 'Map of the floor' }).getByRole('button').first().waitFor();

  /** Where the drawing has the station, to the pixel. */
  async function expectInPlan(): Promise<void> {
    const [x, y] = station.position;
    const drawn = (): Promise<number[]> =>
      page.getByTestId('flat-picture').evaluate(
        (svg, [toX, toY]) => {
          const at = new DOMPoint(toX, toY).matrixTransform((svg as unknown as SVGSVGElement).getScreenCTM()!);
          return [at.x, at.y];
        },
        [x, -y],
      );
    await viewer.settle();
    const [atX, atY] = await viewer.centreOf(station.id);
    expect(await drawn()).toEqual([expect.closeTo(atX, -0.5), expect.closeTo(atY, -0.5)]);
  }
});

test('a picture that the browser takes away leaves the plan of the floor, and comes back as it was', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open(`#floor=${ground.id}`);
  const note = page.getByText('This browser shows no 3D picture');
  const before = await viewer.canvasPixels();
  const lost = await page
    .locator('.scene > canvas')
    .evaluateHandle((canvas: HTMLCanvasElement) => canvas.getContext('webgl2')!.getExtension('WEBGL_lose_context')!);
  await lost.evaluate((context) => context.loseContext());
  await note.waitFor();
  await page.getByTestId('plan-scale').waitFor();
  await expect.poll(() => viewer.shownStations()).toEqual(stations.map(({ id }) => id).sort());
  await viewer.screenshot('no-picture-2-lost');
  await lost.evaluate((context) => context.restoreContext());
  await note.waitFor({ state: 'detached' });
  await expect.poll(() => page.getByTestId('flat-picture').count()).toBe(0);
  await expect.poll(async () => before.shareChanged(await viewer.canvasPixels())).toBeLessThan(0.001);
  await expect.poll(() => page.getByTestId('plan-scale').count()).toBe(0);
});
