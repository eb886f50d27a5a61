/** On site and by keys: what stays where it is, what others change meanwhile, small pictures, paper, names for assistive tools. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Locator } from 'playwright-core';
import { expect, inject, test } from 'vitest';
import { type Look, type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const planFolder = inject('planFolder');
const { plan, ground: floor, stationsOf } = new PlanFiles(planFolder);
const [first, second] = stationsOf(floor.id);

const openPage = viewerPages({ width: 1024, height: 768 });
let viewer: ViewerPage;

async function open(hash: string, look: Look = {}): Promise<void> {
  viewer = await openPage(look);
  await viewer.open(hash);
}

async function openEdit(look: Look = {}): Promise<void> {
  viewer = await openPage(look);
  await viewer.openEditing(`floor=${floor.id}`);
}

const alert = (): Locator => viewer.page.getByRole('alert');

/** Drag a station by its number. */
const drag = async (id: string, dx: number, dy: number): Promise<void> =>
  viewer.dragFrom(await viewer.centreOf(id), dx, dy, 4);

test('a locked station is not dragged, and its place not forbidden', async () => {
  await openEdit();
  await viewer.marker(first.id).click();
  await viewer.page.getByRole('button', { name: 'Lock', exact: true }).click();
  await expect.poll(async () => (await viewer.review()).stations[first.id]?.locked).toBe(true);
  const { revision } = await viewer.review();
  await drag(first.id, 60, 40);
  await viewer.page.mouse.up();
  await expect.poll(() => alert().textContent()).toContain(`Station ${first.id} is locked. Unlock it to move it.`);
  await viewer.screenshot('onsite-1-locked');
  await expect.poll(() => viewer.page.getByRole('button', { name: 'Forbid this position' }).isDisabled()).toBe(true);
  await viewer.tool('Forbid position');
  const [x, y] = await viewer.centreOf(first.id);
  await viewer.page.mouse.click(x - 16, y + 4);
  await expect.poll(() => alert().textContent()).toMatch(new RegExp(`station ${first.id} is locked 0\\.\\d\\d m away`));
  expect((await viewer.review()).revision).toBe(revision);
  // The server refuses it to every page, and says why.
  expect(viewer.faults.splice(0).filter((fault) => !/422|400/.test(fault))).toEqual([]);
});

test('who changed a station while it was dragged is named, and nothing of it is lost', async () => {
  await openEdit();
  const { id } = second;
  await drag(id, 50, 30);
  const raised = (second.instrument_height_m ?? 0) + 0.2;
  await viewer.changeAs('Ben', { kind: 'set_height', station: id, instrument_height_m: raised });
  await expect.poll(async () => (await viewer.review()).stations[id]?.instrument_height_m).toBeCloseTo(raised);
  // This page has heard of it before the pointer lets go.
  await viewer.page.getByText(`${id} moved`).waitFor();
  await viewer.page.mouse.up();
  await viewer.page.getByRole('alertdialog').waitFor();
  await expect.poll(() => viewer.page.getByRole('alertdialog').textContent()).toContain(`Ben changed station ${id}`);
  await viewer.screenshot('onsite-2-conflict');
  await viewer.page.getByRole('button', { name: 'Keep theirs' }).click();
  expect((await viewer.review()).stations[id].instrument_height_m).toBeCloseTo(raised);
  expect(viewer.faults.splice(0).filter((fault) => !/409/.test(fault))).toEqual([]);
});

test('who moved a station and who raised it meanwhile both keep what they did', async () => {
  await openEdit();
  const mine = viewer;
  const ben = await openPage();
  await ben.open(`#floor=${floor.id}&tab=edit`);
  await ben.page.getByTestId('totals').waitFor();
  const { id, position } = second;
  await drag(id, 50, 30);
  // Ben raises it on his page, while it is dragged on mine.
  await ben.page.locator(`.marker[data-station="${id}"]`).click();
  const height = ben.page.getByRole('slider', { name: /Instrument height/ });
  const raised = Number(await height.inputValue()) + 0.2;
  await height.fill(raised.toFixed(2));
  await expect.poll(async () => (await viewer.review()).stations[id]?.instrument_height_m ?? 0).toBeCloseTo(raised);
  await mine.page.mouse.up();
  await mine.page.getByRole('alertdialog').waitFor();
  await mine.screenshot('onsite-2-keep-both');
  await mine.page.getByRole('button', { name: 'Keep both' }).click();
  await expect.poll(async () => (await viewer.review()).stations[id].position_m?.[0]).not.toBeCloseTo(position[0], 2);
  const kept = (await viewer.review()).stations[id];
  expect(kept.instrument_height_m).toBeCloseTo(raised);
  const ground = position[2] - second.instrument_height_m!;
  expect(kept.position_m![2]).toBeCloseTo(ground + raised, 2);
  expect(Math.hypot(kept.position_m![0] - position[0], kept.position_m![1] - position[1])).toBeGreaterThan(0.1);
  // Both pages show it.
  await expect.poll(() => height.inputValue()).toBe(String(Number(raised.toFixed(2))));
  expect([...mine.faults.splice(0), ...ben.faults.splice(0)].filter((fault) => !/409/.test(fault))).toEqual([]);
});

test('keys move the chosen station over its floor as one change, and turn the building', async () => {
  await openEdit();
  const before = await viewer.hash();
  await viewer.page.keyboard.press('q');
  await expect.poll(() => viewer.hash()).not.toBe(before);
  await viewer.press('t');
  const [x0, y0] = await viewer.centreOf(first.id);
  await viewer.marker(first.id).focus();
  await viewer.page.keyboard.press('Enter');
  await viewer.page.getByRole('heading', { name: `Station ${first.id}` }).waitFor();
  const { revision } = await viewer.review();
  await viewer.page.keyboard.press('t');
  await viewer.page.keyboard.down('Shift');
  for (const key of ['ArrowDown', 'ArrowDown', 'ArrowLeft']) {
    await viewer.page.keyboard.press(key);
    await viewer.settle();
  }
  expect((await viewer.review()).revision).toBe(revision);
  await viewer.page.keyboard.up('Shift');
  await expect.poll(async () => (await viewer.review()).revision).toBe(revision + 1);
  const [x, y] = (await viewer.review()).stations[first.id].position_m!;
  // To the millimetre: south twice, west once; or as far as a tripod can stand.
  expect(Math.hypot(x - first.position[0], y - first.position[1])).toBeGreaterThan(0.09);
  expect([x <= first.position[0] + 1e-6, y <= first.position[1] + 1e-6]).toEqual([true, true]);
  await viewer.press('t');
  const [x1, y1] = await viewer.centreOf(first.id);
  expect([x1 <= x0 + 0.5, y1 >= y0 - 0.5]).toEqual([true, true]);
  await viewer.page.keyboard.press('Control+z');
  await expect.poll(async () => (await viewer.review()).stations[first.id]?.position_m ?? null).toBeNull();
});

test('a station added where no tripod can stand says how far beside it is', async () => {
  await openEdit();
  await viewer.tool('Add station');
  const { revision } = await viewer.review();
  const table = await tablePlace();
  await viewer.page.mouse.click(...table);
  await expect.poll(async () => (await viewer.review()).revision).toBe(revision + 1);
  await expect
    .poll(() => alert().textContent())
    .toMatch(/No tripod can stand at that point: S\d+ was added \d\.\d\d m away/);
  await viewer.screenshot('onsite-3-added');
  const [added] = Object.values((await viewer.review()).stations).filter((edit) => edit.added);
  const heights = plan.stations.map(({ instrument_height_m }) => instrument_height_m);
  expect(heights).toContain(added.instrument_height_m);
  await viewer.page.keyboard.press('Control+z');
  await expect.poll(async () => Object.values((await viewer.review()).stations).some((edit) => edit.added)).toBe(false);
});

/** A place of the page over a table top: of the dining room's, between two stations, or of another one around it. */
async function tablePlace(): Promise<[number, number]> {
  const [[x0, y0], [x1, y1]] = [await viewer.centreOf(first.id), await viewer.centreOf(plan.stations[3].id)];
  for (let ring = 0; ring < 9; ring++) {
    for (let i = 0; i < 8; i++) {
      const angle = (i * Math.PI) / 4;
      const place: [number, number] = [
        (x0 + x1) / 2 + 20 * ring * Math.cos(angle),
        (y0 + y1) / 2 + 20 * ring * Math.sin(angle),
      ];
      if (await isTable(...place)) return place;
    }
  }
  throw new Error('no table in the picture');
}

async function isTable(x: number, y: number): Promise<boolean> {
  const { page } = viewer;
  if (!(await viewer.isBare(x, y))) return false;
  await viewer.tool('Move');
  await page.mouse.click(x, y);
  await viewer.settle();
  const card = page.getByRole('complementary', { name: 'Clicked surface' });
  const words = (await card.count()) > 0 ? ((await card.textContent()) ?? '') : '';
  await page.keyboard.press('Escape');
  await viewer.tool('Add station');
  return /table/i.test(words);
}

test('what is not planned and what is not met stand beside the headline, and show in the building', async () => {
  viewer = await openPage();
  const inside = [...first.position] as [number, number, number];
  inside[2] = floor.elevation_m;
  const results = plan.requirements.results.map((result, i) =>
    i === 0 ? { ...result, fraction_of_achievable: 0.931, met: false } : result,
  );
  await viewer.page.route('**/plan/plan.json', async (route) => {
    const body = await (await route.fetch()).json();
    const [x, y] = inside;
    const rectangles = [
      [
        [x - 1.5, y - 1],
        [x + 1.5, y + 1],
      ],
    ];
    const sealed = [{ floor: floor.id, area_m2: 1096, inside, rectangles }];
    await route.fulfill({ json: { ...body, sealed, requirements: { ...body.requirements, results } } });
  });
  await viewer.open();
  const list = viewer.page.getByRole('list', { name: 'What falls short' }).getByRole('button');
  const words = await list.allTextContents();
  expect(words[0]).toContain('Not planned: 1,096.0 m² of floor that can’t be reached on foot, in one area');
  expect(words[1]).toContain(`Not met: ${results[0].name} 93.1 % of 95 %`);
  const nGroups = plan.registration.networks.length;
  expect(words[2] ?? '').toContain(nGroups > 1 ? `${nGroups} unconnected groups` : '');
  // No green for a share that leaves so much out.
  const whole = viewer.page.getByTestId('requirements').locator('tr', { hasText: 'Whole building' });
  await expect.poll(() => whole.locator('.badge-good').count()).toBe(0);
  await expect.poll(() => whole.textContent()).toContain('without 1,096.0 m² of floor that can’t be reached');
  await viewer.screenshot('onsite-4-shortfalls');
  const before = await viewer.canvasPixels();
  await list.first().click();
  await expect.poll(() => viewer.hash()).toContain(`floor=${floor.id}`);
  await viewer.settle();
  const shown = await viewer.canvasPixels();
  expect(shown.shareChanged(before)).toBeGreaterThan(0.1);
  await viewer.screenshot('onsite-5-unreachable');
  // The red dot and the words on red that mark it, and its ground in red through which the floor is seen: orange is unseen.
  expect(shown.share(([r, g, b]) => r > 160 && g < 70 && b < 80)).toBeGreaterThan(2e-3);
  expect(shown.share(([r, g, b]) => r > 100 && g > 55 && r - g > 30 && Math.abs(g - b) < 30)).toBeGreaterThan(0.005);
  await list.nth(1).click();
  await expect.poll(() => viewer.hash()).toContain('tab=unseen');
});

test('a coverage reads the same in headline, curve, floors, the bar of the edited plan, and the report', async () => {
  await openEdit();
  const bar = await viewer.page.getByTestId('totals').textContent();
  await viewer.page.getByRole('tab', { name: 'Runs' }).click();
  const curve = await viewer.page.locator('svg.curve').getAttribute('aria-label');
  await viewer.page.getByRole('tab', { name: 'Plan' }).click();
  const headline = (await viewer.page.getByTestId('coverage').textContent())!;
  expect(bar).toContain(`Coverage${headline}`);
  expect(curve).toContain(`${plan.stations.length} stations, ${headline}`);
  // The report rounds as the viewer does: "95.3 % of the 431 m² scannable".
  const report = readFileSync(join(planFolder, 'report', 'index.html'), 'utf8').replaceAll('\u00a0', ' ');
  expect(report).toContain(`${headline} of the ${plan.coverage.achievable_area_m2.toFixed(0)} m² scannable`);
  const rows = viewer.page.getByTestId('requirements').locator('tr');
  await expect.poll(() => rows.filter({ hasText: 'Whole building' }).textContent()).toContain(headline);
  for (const { id, name } of plan.floors) {
    const share = await viewer.page.locator(`[data-floor="${id}"] .row-figure`).textContent();
    await expect.poll(() => rows.filter({ hasText: name }).textContent()).toContain(share!.trim());
  }
});

test.each([
  ['a phone', 390, 780],
  ['a desk at 200 %', 640, 400],
  ['a tablet', 1024, 768],
  ['a desk', 1440, 900],
])('on %s the picture has room, and nothing of the bar is cut off', async (name, width, height) => {
  await openEdit({ width, height });
  // More words than of the plan as it was made: what each figure lost, and the groups that it fell into.
  await viewer.changeAs('Ben', { kind: 'remove_station', station: second.id });
  await expect.poll(() => viewer.page.getByTestId('totals').textContent()).toContain('−1');
  const scene = (await viewer.page.locator('.scene').boundingBox())!;
  expect(scene.height).toBeGreaterThan(200);
  const cut = await viewer.page.locator('.draft-bar, .draft-bar *').evaluateAll((all) =>
    all
      .filter((one) => one.scrollWidth > one.clientWidth + 1 || one.scrollHeight > one.clientHeight + 1)
      .filter((one) => getComputedStyle(one).overflow !== 'visible')
      .map((one) => one.className),
  );
  expect(cut).toEqual([]);
  const box = (await viewer.page.locator('.draft-bar').boundingBox())!;
  expect(box.x + box.width).toBeLessThanOrEqual(width);
  const beyond = await viewer.page
    .locator('.draft-bar *')
    .evaluateAll((all, right) => all.filter((one) => one.getBoundingClientRect().right > right + 0.5).length, width);
  expect(beyond).toBe(0);
  await viewer.screenshot(`onsite-6-${name.replace(/[^a-z0-9]+/g, '-')}`);
});

test('what is written on a number is in its name, and no head of a table is empty', async () => {
  await open(`#floor=${floor.id}`);
  const names = await viewer.page
    .locator('.marker')
    .evaluateAll((all) => all.map((one) => [one.textContent ?? '', one.getAttribute('aria-label') ?? '']));
  expect(names).toHaveLength(plan.stations.length);
  for (const [number, name] of names) expect(name.split(/[\s,]+/)).toContain(number);
  await viewer.changeAs('Ben', { kind: 'remove_station', station: second.id });
  await viewer.page.getByText('as edited', { exact: true }).first().waitFor();
  const heads = await viewer.page.locator('th').evaluateAll((all) => all.map((one) => one.textContent?.trim() ?? ''));
  expect(heads.length).toBeGreaterThan(3);
  expect(heads).not.toContain('');
});

test('on paper the numbers stand where they do on the screen, and nothing is cut off', async () => {
  await open(`#floor=${floor.id}`);
  await viewer.press('t');
  const places = (): Promise<number[][]> =>
    viewer.page.evaluate(() => {
      const scene = document.querySelector('.scene')!.getBoundingClientRect();
      return [...document.querySelectorAll('.marker:not([hidden])')].map((one) => {
        const box = one.getBoundingClientRect();
        return [(box.x + box.width / 2 - scene.x) / scene.width, (box.y + box.height / 2 - scene.y) / scene.height];
      });
    });
  const onScreen = await places();
  await viewer.page.evaluate(() => window.dispatchEvent(new Event('beforeprint')));
  await viewer.page.emulateMedia({ media: 'print' });
  await viewer.page.setViewportSize({ width: 718, height: 1046 });
  await viewer.settle();
  const onPaper = await places();
  expect(onPaper).toHaveLength(onScreen.length);
  onPaper.forEach(([x, y], i) => {
    expect([x, y]).toEqual([expect.closeTo(onScreen[i][0], 2), expect.closeTo(onScreen[i][1], 2)]);
  });
  const scene = (await viewer.page.locator('.scene').boundingBox())!;
  expect(scene.width).toBeLessThanOrEqual(718);
  const clipped = await viewer.page
    .locator('.workspace, .sidebar, .stage')
    .evaluateAll((all) => all.filter((one) => one.scrollHeight > one.clientHeight + 1).map((one) => one.className));
  expect(clipped).toEqual([]);
  await viewer.screenshot('onsite-7-print');
  // The copy is a picture of the building, not of nothing.
  const colours = await viewer.page.evaluate(() => {
    const copy = document.querySelector<HTMLCanvasElement>('.print-picture')!;
    const { data } = copy.getContext('2d')!.getImageData(0, 0, copy.width, copy.height);
    const found = new Set<number>();
    for (let i = 0; i < data.length; i += 404) found.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    return found.size;
  });
  expect(colours).toBeGreaterThan(20);
  const pdf = (await viewer.page.pdf({ format: 'A4', printBackground: true })).toString('latin1');
  expect((pdf.match(/\/Type\s*\/Page\b/g) ?? []).length).toBeGreaterThan(1);
  await viewer.page.evaluate(() => window.dispatchEvent(new Event('afterprint')));
  await expect.poll(() => viewer.page.locator('.print-picture').count()).toBe(0);
});

test.each([
  ['a phone', { width: 390, height: 844, isMobile: true }],
  ['a desk', { width: 1024, height: 768 }],
])('on paper the picture of %s with a card keeps its form', async (name, look) => {
  await open(`#floor=${floor.id}&station=${second.id}`, look);
  await viewer.page.locator('.cards > .card').first().waitFor();
  await viewer.settle();
  const form = (of: string): Promise<number> =>
    viewer.page.locator(of).evaluate((one) => one.getBoundingClientRect().width / one.getBoundingClientRect().height);
  const onScreen = await form('.scene > canvas');
  await viewer.page.evaluate(() => window.dispatchEvent(new Event('beforeprint')));
  await viewer.page.emulateMedia({ media: 'print' });
  await viewer.page.setViewportSize({ width: 718, height: 1046 });
  await viewer.settle();
  expect(await form('.print-picture')).toBeCloseTo(onScreen, 2);
  await viewer.screenshot(`onsite-8-print-${name.slice(2)}`);
});

test('on paper the review has all stations, and the date of each verdict', async () => {
  await open('#tab=review');
  await viewer.changeAs('Ben', { kind: 'set_verdict', station: second.id, verdict: 'accepted' });
  const list = viewer.page.getByRole('list', { name: 'Verdicts' });
  await list.getByText('accepted by Ben').waitFor();
  await expect
    .poll(() => list.getByText('accepted by Ben').textContent())
    .toMatch(/ on \d+ [A-Z][a-z]+ \d{4} at \d\d:\d\d$/);
  await viewer.page.emulateMedia({ media: 'print' });
  await viewer.page.setViewportSize({ width: 718, height: 1046 });
  await viewer.settle();
  await expect.poll(() => list.locator('li').count()).toBe(plan.stations.length);
  const clipped = await viewer.page
    .locator('.sidebar, .sidebar ul, .sidebar section')
    .evaluateAll((all) => all.filter((one) => one.scrollHeight > one.clientHeight + 1).map((one) => one.className));
  expect(clipped).toEqual([]);
  await viewer.screenshot('onsite-8-print-review');
});
