/** What everybody does with the viewer, in eight journeys; corner cases are in the files beside this one. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Page } from 'playwright-core';
import { expect, inject, test } from 'vitest';
import type { DraftRoute, Run } from '../src/api/documents.ts';
import { addZone } from '../src/edit/changes.ts';
import { type Door, doorsOf } from '../src/edit/doors.ts';
import { draftStations } from '../src/edit/draft.ts';
import { routeStops } from '../src/field/route.ts';
import { readStage } from '../src/load/stage.ts';
import { countingOf, networkOf } from '../src/network/graph.ts';
import { type PagePoint, type Rgb, type ViewerPage, viewerPages } from './browser.ts';
import { countGl, glCount } from './gl-meter.ts';
import { PlanFiles } from './plan-files.ts';
import { PYTHON, REPOSITORY, serveStatic } from './plan-server.ts';

const planFolder = inject('planFolder');
const files = new PlanFiles(planFolder);
const { plan, floors, ground, stationsOf } = files;
const stations = stationsOf(ground.id);
const [first, second] = stations;
/** Not on the stairs, where instruments stand higher. */
const onFloor = stations.filter(({ position: [, , z] }) => z < ground.elevation_m + 1.5);
const RUN_MS = 540_000;

const openPage = viewerPages({ width: 960, height: 600, pixelRatio: process.env.TLSPLAN_E2E_PICTURES ? 1 : 0.25 });

const isPurple = ([r, g, b]: Rgb): boolean => b > g + 40 && r > g + 25;
const isVivid = (rgb: Rgb): boolean => Math.max(...rgb) - Math.min(...rgb) > 70;
const areaIn = (text: string | null): number => Number(/([\d.,]+) m²/.exec(text ?? '')?.[1].replace(',', ''));
const lengthIn = (text: string | null): number => Number(/([\d.]+) m/.exec(text ?? '')?.[1]);

test('a plan is opened: its figures, floors and clouds, and a station with its panorama', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await countGl(page);
  await viewer.open();
  const coverage = `${(100 * plan.coverage.fraction_of_achievable).toFixed(1)} %`;
  await expect.poll(() => page.getByTestId('coverage').textContent()).toBe(coverage);
  await expect.poll(() => page.getByTestId('station-count').textContent()).toBe(String(plan.stations.length));
  await expect.poll(() => page.locator('li [data-station]').count()).toBe(plan.stations.length);
  expect(await page.title()).toContain(plan.scene.file);
  let before = await viewer.canvasPixels();
  const background = before.at(950, 300);
  const drawn = before.share((rgb) => rgb.some((value, k) => Math.abs(value - background[k]) > 8));
  expect(drawn).toBeGreaterThan(0.15);
  expect(drawn).toBeLessThan(0.95);
  await viewer.screenshot('journey-1-opened');

  for (const floor of floors) {
    await page.locator(`[data-floor="${floor.id}"]`).click();
    await viewer.settle();
    const after = await viewer.canvasPixels();
    expect(before.shareChanged(after)).toBeGreaterThan(0.05);
    await expect.poll(() => viewer.shownStations()).toEqual(stationsOf(floor.id).map(({ id }) => id));
    await expect.poll(() => page.locator('li [data-station]').count()).toBe(stationsOf(floor.id).length);
    before = after;
  }
  await page.getByLabel('Height of the cut').fill('0.4');
  await viewer.settle();
  expect(before.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.02);
  await page.locator('[data-floor=all]').click();
  await page.getByText('Spread floors apart').click();
  await viewer.settle();
  await expect.poll(() => viewer.shownStations()).toEqual(plan.stations.map(({ id }) => id).sort());

  await viewer.open(`#floor=${ground.id}`);
  const building = await viewer.canvasPixels();
  const cloud = page.locator('[data-testid=cloud][data-state=shown]');
  await page.getByRole('button', { name: 'Clouds' }).click();
  await cloud.waitFor();
  const key = page.getByRole('list', { name: 'Clouds by station' });
  await expect.poll(() => key.getByRole('checkbox').count()).toBe(stations.length);
  // The previews have half of the lidar's beams, and the page states it.
  await expect
    .poll(() => cloud.textContent())
    .toMatch(new RegExp(`from ${stations.length} stations: 1 beam in 2 drawn`));
  await viewer.settle();
  const all = await viewer.canvasPixels();
  const { bytes } = await glCount(page);
  await key.getByLabel(first.id).uncheck();
  await expect.poll(() => cloud.textContent()).toContain(`from ${stations.length - 1} stations`);
  await viewer.settle();
  expect(all.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.001);
  expect((await glCount(page)).bytes).toBeLessThan(bytes);
  await page.getByRole('button', { name: 'None' }).click();
  await cloud.waitFor({ state: 'detached' });
  await key.getByLabel(second.id).check();
  await expect.poll(() => cloud.textContent()).toContain('returns: 1 beam in 2 drawn');
  await page.getByRole('button', { name: 'All', exact: true }).click();
  await expect.poll(() => cloud.textContent()).toContain(`from ${stations.length} stations`);
  await page.getByRole('button', { name: 'Clouds' }).click();
  await cloud.waitFor({ state: 'detached' });

  await page.mouse.click(...(await viewer.centreOf(first.id)));
  await cloud.waitFor();
  await viewer.settle();
  const [x, y, z] = first.position.map((value) => `${value.toFixed(3)} m`);
  await expect
    .poll(() => viewer.figures('station-figures'))
    .toMatchObject({
      x,
      y,
      z,
      'Instrument height': `${first.instrument_height_m?.toFixed(2)} m`,
      'Seen area': `${first.covered_area_m2.toFixed(1)} m²`,
      'Unique area': `${first.own_area_m2.toFixed(1)} m²`,
    });
  const links = plan.registration.links.filter(({ a, b }) => a === first.id || b === first.id);
  const { threshold, min_probability } = plan.registration;
  const strong = links.filter(
    ({ overlap, probability }) => overlap >= threshold && (probability ?? 0) >= min_probability,
  );
  await expect.poll(() => page.locator('.links .chip-strong').count()).toBe(Math.min(8, strong.length));
  await expect.poll(() => viewer.marker(first.id).getAttribute('aria-pressed')).toBe('true');
  await expect.poll(() => viewer.hash()).toBe(`#floor=${ground.id}&station=${first.id}`);
  const { nBeams, nReturns } = files.cloud(first.id);
  await expect.poll(() => page.getByTestId('cloud').textContent()).toContain(nReturns.toLocaleString('en'));
  const withCloud = await viewer.canvasPixels();
  expect(building.shareChanged(withCloud)).toBeGreaterThan(0.1);
  // The building has stepped back to grey: what is strongly coloured is the cloud.
  expect(withCloud.share(isVivid)).toBeGreaterThan(0.01);
  await viewer.screenshot('journey-1-station');
  await page.getByLabel('Colour of the cloud').selectOption('intensity');
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isVivid)).toBeLessThan(0.3 * withCloud.share(isVivid));

  await page.getByRole('button', { name: 'Panorama' }).click();
  const picture = page.getByRole('img', { name: `Panorama of station ${first.id}` });
  const shareDrawn = await picture.evaluate((canvas: HTMLCanvasElement) => {
    const { data } = canvas.getContext('2d')!.getImageData(0, 0, canvas.width, canvas.height);
    let n = 0;
    for (let i = 3; i < data.length; i += 4) if (data[i] > 0) n++;
    return n / (canvas.width * canvas.height);
  });
  expect(Math.abs(shareDrawn - nReturns / nBeams)).toBeLessThan(0.1);
  const box = (await picture.boundingBox())!;
  const readings: string[] = [];
  for (let i = 1; i < 12; i++) {
    await page.mouse.move(box.x + (i / 12) * box.width, box.y + 0.7 * box.height);
    readings.push((await page.locator('.panorama p').textContent()) ?? '');
  }
  expect(readings).toContainEqual(expect.stringMatching(/^Range [\d.]+ m, incidence \d+°$/));
  await page.mouse.click(box.x + 0.5 * box.width, box.y + 0.7 * box.height);
  await picture.waitFor({ state: 'detached' });
});

test('a plan is inspected: unseen surfaces, the network, who sees a surface, lengths, and a section', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#tab=unseen');
  const rows = page.locator('.unseen > button');
  const legend = page.getByTestId('legend');
  const areas = (await rows.locator('.row-area').allTextContents()).map(areaIn);
  expect(areas.length).toBeGreaterThan(3);
  expect([...areas].sort((a, b) => b - a)).toEqual(areas);
  const unseen = [...plan.why!.unseen_surfaces].sort((a, b) => b.area_m2 - a.area_m2);
  expect(areas[0]).toBeCloseTo(unseen[0].area_m2, 0);
  await page.getByRole('button', { name: /reachable, left out/ }).click();
  expect((await viewer.canvasPixels()).share(isPurple)).toBeLessThan(0.001);
  await rows.first().click();
  await page.locator('[data-testid=legend][data-state=shown]').waitFor();
  await viewer.settle();
  expect((await viewer.canvasPixels()).share(isPurple)).toBeGreaterThan(0.005);
  await expect.poll(() => legend.textContent()).toContain('reachable, left out');
  // The list, the legend and the highlighted surface have one figure.
  const [piece] = unseen.find(({ reason }) => reason === 'not worth a station')!.pieces;
  expect(areaIn(await legend.textContent())).toBeCloseTo(piece.area_m2, 1);
  await viewer.screenshot('journey-2-unseen');
  await viewer.press('Escape');
  expect((await viewer.canvasPixels()).share(isPurple)).toBeLessThan(0.001);

  await page.getByRole('tab', { name: 'Network' }).click();
  const ids = plan.stations.map(({ id }) => id);
  const { components, counting, bridges, weakest } = networkOf(ids, plan.registration.links, countingOf(plan));
  const shown = await viewer.figures('network-figures');
  expect(shown.Network).toContain(components.length === 1 ? 'connected' : `${components.length} unconnected groups`);
  expect(shown['Registration links']).toBe(String(counting.length));
  expect(shown['Single-link connections']).toBe(String(bridges.size));
  expect(shown['Weakest link']).toContain(`${weakest!.a} – ${weakest!.b}`);
  await page.getByTestId('network-figures').getByRole('button').click();
  await page.getByRole('heading', { name: `${weakest!.a} – ${weakest!.b}` }).waitFor();
  await expect.poll(() => page.locator('.graph-node').count()).toBe(ids.length);

  await viewer.open(`#floor=${ground.id}`);
  await viewer.press('p');
  await page.getByTestId('plan-scale').waitFor();
  await expectPlanToScale(viewer);
  const [fromX, fromY] = await viewer.centreOf(first.id);
  let nSeeing = 0;
  for (const [dx, dy] of [
    [20, 25],
    [-40, 20],
    [-30, -50],
  ]) {
    await page.mouse.click(fromX + dx, fromY + dy);
    await page.getByTestId('surface-figures').waitFor();
    nSeeing = Math.max(nSeeing, await expectSights(viewer));
  }
  expect(nSeeing).toBeGreaterThan(1);
  await expect.poll(() => page.locator('.sight-lines polyline').count()).toBeGreaterThan(1);
  await viewer.screenshot('journey-2-sights');
  await page.getByRole('button', { name: 'Close' }).click();
  await expect.poll(() => page.locator('.sight-lines polyline').count()).toBe(0);
  await expectWallDistances(viewer);
  await page.getByRole('button', { name: 'Measure', exact: true }).click();
  await page.getByRole('button', { name: 'Surface', exact: true }).click();
  for (const key of ['ArrowRight', 'ArrowDown', 'Enter']) await page.keyboard.press(key);
  await page.getByTestId('surface-figures').waitFor();
  await expectSights(viewer);
  await page.getByRole('button', { name: 'Close' }).first().click();

  await measureHouse(viewer);
  await viewer.open(`#floor=${ground.id}`);
  await cutByBox(viewer);
});

/** In the plan view lengths have one scale everywhere, and the bar states it; a drag shifts the plan. */
async function expectPlanToScale(viewer: ViewerPage): Promise<void> {
  const { page } = viewer;
  const centres = await Promise.all(stations.map(({ id }) => viewer.centreOf(id)));
  const scales: number[] = [];
  for (const [i, a] of stations.entries()) {
    for (const [j, b] of stations.entries()) {
      const m = Math.hypot(a.position[0] - b.position[0], a.position[1] - b.position[1]);
      if (i < j && m >= 2) scales.push(Math.hypot(centres[i][0] - centres[j][0], centres[i][1] - centres[j][1]) / m);
    }
  }
  expect(scales.length).toBeGreaterThan(20);
  // Numbers are on whole pixels; with perspective those of higher and lower stations would differ by more.
  for (const scale of scales) expect(scale / scales[0]).toBeCloseTo(1, 1.9);
  const words = page.getByTestId('scale-words');
  const bar = Number(await words.getAttribute('data-pixels'));
  expect(bar / lengthIn(await words.textContent()) / scales[0]).toBeCloseTo(1, 1.9);
  await expect.poll(() => page.getByTestId('plan-grid').locator('line').count()).toBeGreaterThan(5);
  await expect.poll(() => page.getByTestId('plan-scale').textContent()).toContain('north');
  await expect.poll(() => viewer.hash()).toContain('flat');
  await viewer.dragFrom([900, 480], 30, -20, 2);
  await page.mouse.up();
  const [x, y] = await viewer.centreOf(first.id);
  expect([x - centres[0][0], y - centres[0][1]]).toEqual([expect.closeTo(30, -0.5), expect.closeTo(-20, -0.5)]);
}

/** The card of the clicked surface lists the stations that see it as the plan's files have them; how many do. */
async function expectSights(viewer: ViewerPage): Promise<number> {
  const { page } = viewer;
  const patch = Number(await page.getByTestId('surface-figures').getAttribute('data-patch'));
  const figures = await viewer.figures('surface-figures');
  const at = figures.Position.split(', ').map(Number);
  const seeing = plan.stations.filter(({ id }) => (files.bytes(`seen/${id}.bits`)[patch >> 3] >> (patch & 7)) & 1);
  const list = page.getByRole('list', { name: 'Stations that see it' }).locator('li');
  if (seeing.length > 0) await list.first().waitFor();
  const rows = await list.evaluateAll((all) =>
    all.map((row) => [...row.querySelectorAll('span')].map((part) => part.textContent ?? '')),
  );
  expect(rows.map(([id]) => id).sort()).toEqual(seeing.map(({ id }) => id));
  for (const [id, range, incidence] of rows) {
    const [dx, dy, dz] = seeing.find((one) => one.id === id)!.position.map((x, k) => x - at[k]);
    expect(Math.abs(Number.parseFloat(range) - Math.hypot(dx, dy, dz))).toBeLessThan(0.02);
    // Of level ground; at what stands upright the wall decides.
    if (figures['Walkable floor'] === undefined) continue;
    const degrees = (Math.atan2(Math.hypot(dx, dy), Math.abs(dz)) * 180) / Math.PI;
    expect(Math.abs(Number.parseFloat(incidence) - degrees)).toBeLessThan(1.1);
  }
  expect(rows.map(([, , , best]) => best)).toEqual(rows.map((_, i) => (i === 0 ? 'best' : undefined)));
  return seeing.length;
}

/** Corners of walls snap: the house measures 10 x 8 m and 80 m² though no click is exact. */
async function measureHouse(viewer: ViewerPage): Promise<void> {
  const { page } = viewer;
  const results = page.getByTestId('measurement');
  const kind = (name: string) => page.getByRole('button', { name, exact: true }).click();
  // Inner and outer corners are apart in a large picture only.
  await page.setViewportSize({ width: 1280, height: 800 });
  await kind('Distance');
  // The panel lies over a corner: a drag brings the house out from under it.
  for (let i = 0; i < 2; i++) await viewer.press('-');
  await viewer.dragFrom([900, 640], 175, 40, 2);
  await page.mouse.up();
  const place = await viewer.planToPage(stations);
  const corners = [
    [0, 0],
    [10, 0],
    [10, 8],
    [0, 8],
  ].map(([x, y], i): PagePoint => {
    const [atX, atY] = place(x, y);
    return [atX + (i % 2 === 0 ? 4 : -5), atY + (i < 2 ? -4 : 3)];
  });
  await page.mouse.move(...corners[1]);
  await viewer.settle();
  await expect.poll(() => page.locator('.measure-mark').getAttribute('data-on')).toBe('corner');
  for (const i of [1, 2]) await page.mouse.click(...corners[i]);
  expect(lengthIn(await results.first().locator('strong').textContent())).toBeCloseTo(8, 3);
  await kind('Area');
  for (const i of [0, 1, 2, 3, 0]) await page.mouse.click(...corners[i]);
  await expect.poll(() => results.count()).toBe(2);
  await expect.poll(() => results.first().locator('strong').textContent()).toBe('80.00 m²');
  expect(lengthIn(await results.first().locator('dd').first().textContent())).toBeCloseTo(36, 2);
  await kind('Angle');
  for (const i of [0, 1, 2]) await page.mouse.click(...corners[i]);
  await expect.poll(() => results.count()).toBe(3);
  await expect.poll(() => results.first().locator('strong').textContent()).toBe('90.00°');
  await viewer.screenshot('journey-2-measured');
  await page.setViewportSize({ width: 960, height: 600 });
  await page.getByRole('button', { name: 'Plan view' }).click();
  await viewer.settle();
  await expect.poll(() => page.getByTestId('plan-scale').count()).toBe(0);
  await expect.poll(() => viewer.hash()).not.toContain('flat');
}

/** The card of a station in the living room has its distances square to the walls. */
async function expectWallDistances(viewer: ViewerPage): Promise<void> {
  const { page } = viewer;
  /** Inner faces of the walls of the living room, and of the one beside it, as scenes_synthetic builds them. */
  const [south, north, spine] = [0.3, 7.7, 5.2];
  const station = stations.find(({ position: [x, y] }) => x > 5.5 && x < 7 && y > 2 && y < 4)!;
  const [x, y] = station.position;
  await viewer.marker(station.id).click();
  await page.getByText('Distances to walls').click();
  const rows = await page.getByTestId('set-up-distances').locator('dd').allTextContents();
  const lengths = rows.map(lengthIn).slice(0, 3);
  const expected = [x - spine, y - south, north - y];
  expect(lengths.sort((a, b) => a - b)).toEqual(expected.sort((a, b) => a - b).map((m) => expect.closeTo(m, 2)));
  await expect.poll(() => page.locator('.set-up polyline').count()).toBe(2 * rows.length);
  await page.getByText('Distances to walls').click();
  await expect.poll(() => page.locator('.set-up polyline').count()).toBe(0);
}

/** A box is dragged, moved by keys and typed; what is outside it is not shown, stations included. */
async function cutByBox(viewer: ViewerPage): Promise<void> {
  const { page } = viewer;
  const south = page.getByRole('slider', { name: 'South side of the section box' });
  const southM = async (): Promise<number> => Number(await south.getAttribute('aria-valuenow'));
  const field = (name: string) => page.getByLabel(`${name}, m`, { exact: true });
  // In a smaller picture the panel covers numbers of stations in part, and those are hidden.
  await page.setViewportSize({ width: 1440, height: 900 });
  await page.getByRole('button', { name: 'Section', exact: true }).click();
  await page.getByRole('button', { name: 'Box', exact: true }).click();
  await viewer.settle();
  expect((await viewer.shownStations()).length).toBeGreaterThanOrEqual(onFloor.length);
  const whole = await viewer.canvasPixels();
  const before = await southM();
  const box = (await south.boundingBox())!;
  expect(Math.min(box.width, box.height)).toBeGreaterThanOrEqual(24);
  await viewer.dragFrom([box.x + box.width / 2, box.y + box.height / 2], -30, -96, 3);
  await page.mouse.up();
  const dragged = await southM();
  expect(dragged).toBeGreaterThan(before + 1);
  expect(whole.shareChanged(await viewer.canvasPixels())).toBeGreaterThan(0.05);
  await viewer.screenshot('journey-2-section');

  await south.focus();
  await page.keyboard.press('ArrowUp');
  await expect.poll(southM).toBeCloseTo(dragged + 0.1, 2);
  await expect.poll(() => page.getByLabel('Shown floor').inputValue()).toBe('');
  await field('South').fill('4.5');
  await field('South').press('Enter');
  await viewer.settle();
  await expect.poll(southM).toBeCloseTo(4.5, 3);
  const northern = onFloor.filter(({ position }) => position[1] > 4.5).map(({ id }) => id);
  const ofGround = (await viewer.shownStations()).filter((id) => stations.some((one) => one.id === id));
  expect(ofGround).toEqual(northern.sort());
  // An invalid value is marked, and nothing changes.
  await field('North').fill('far');
  await field('North').press('Enter');
  await expect.poll(() => field('North').getAttribute('aria-invalid')).toBe('true');
  await field('North').press('Escape');
  await page.getByRole('button', { name: 'Whole building' }).click();
  await viewer.settle();
  await expect.poll(() => page.getByLabel('Shown floor').inputValue()).toBe(ground.id);
  await expect.poll(() => viewer.shownStations()).toEqual(stations.map(({ id }) => id).sort());
}

test('stations are edited: dragged, undone and redone, moved by coordinates, and several together', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.openEditing(`floor=${ground.id}`);
  const totals = (): Promise<string | null> => page.getByTestId('totals').textContent();
  const positionOf = async (id: string) => (await viewer.review()).stations[id]?.position_m ?? null;
  const before = await totals();
  const { revision } = await viewer.review();
  const start = await viewer.centreOf(first.id);
  await viewer.dragFrom(start, 70, 40);
  await expect.poll(totals).not.toBe(before);
  await viewer.screenshot('journey-3-dragging');
  await page.mouse.up();
  const { position_m: moved } = (await viewer.changedFrom(revision)).stations[first.id];
  expect(moved).not.toEqual(first.position);
  await page.getByText(`${first.id} moved`).waitFor();
  await viewer.settle();
  const end = await viewer.centreOf(first.id);
  expect(Math.hypot(end[0] - start[0], end[1] - start[1])).toBeGreaterThan(15);
  await expect.poll(() => viewer.marker(first.id).getAttribute('class')).toContain('marker-moved');
  await page.keyboard.press('Control+z');
  await expect.poll(() => positionOf(first.id)).toBeNull();
  await expect.poll(totals).toBe(before);
  await page.keyboard.press('Control+Shift+z');
  await expect.poll(() => positionOf(first.id)).toEqual(moved);
  await viewer.undo();

  await viewer.marker(first.id).click();
  const x = page.getByLabel('x, m', { exact: true });
  await expect.poll(() => x.inputValue()).toBe(first.position[0].toFixed(3));
  const toX = (first.position[0] + 0.25).toFixed(3);
  await x.fill(toX.replace('.', ','));
  await x.press('Enter');
  await expect.poll(async () => (await positionOf(first.id))?.[0] ?? 0).toBeCloseTo(Number(toX), 3);
  expect((await positionOf(first.id))![1]).toBeCloseTo(first.position[1], 3);
  await page.getByRole('button', { name: 'Move 0.10 m south' }).click();
  await expect.poll(async () => (await positionOf(first.id))![1]).toBeCloseTo(first.position[1] - 0.1, 3);
  const typed = (await viewer.review()).revision;
  await x.fill('-900');
  await x.press('Enter');
  await page.getByText(/No tripod can stand at -900\.00, .* The nearest position is /).waitFor();
  expect((await viewer.review()).revision).toBe(typed);
  await viewer.undo();
  await viewer.undo();
  await page.keyboard.press('Escape');

  // Two of the living room, where there is room.
  const [a, b] = stations.filter(({ position }) => position[0] > 5.5);
  const shifts = async (): Promise<(number[] | null)[]> => {
    const { stations: edits } = await viewer.review();
    return [a, b].map(
      ({ id, position }) =>
        edits[id]?.position_m?.slice(0, 2).map((m, k) => Number((m - position[k]).toFixed(3))) ?? null,
    );
  };
  const nEdits = async (what: 'locked' | 'removed'): Promise<number> =>
    Object.values((await viewer.review()).stations).filter((edit) => edit[what]).length;
  const [[, y0], [, y1]] = [await viewer.centreOf(a.id), await viewer.centreOf(b.id)];
  const pixelsPerM = Math.abs((y1 - y0) / (b.position[1] - a.position[1]));
  await viewer.marker(a.id).click();
  await viewer.marker(b.id).click({ modifiers: ['Shift'] });
  await page.getByRole('heading', { name: '2 stations selected' }).waitFor();
  await expect.poll(() => viewer.marker(a.id).getAttribute('aria-pressed')).toBe('true');
  const north = page.getByLabel('North, m', { exact: true });
  await north.fill('-0.2');
  await page.getByRole('button', { name: 'Move', exact: true }).click();
  await expect.poll(shifts).toEqual([
    [0, -0.2],
    [0, -0.2],
  ]);
  await viewer.undo();
  await expect.poll(shifts).toEqual([null, null]);
  const together = (await viewer.review()).revision;
  await north.fill('-2');
  await page.getByRole('button', { name: 'Move', exact: true }).click();
  await page.getByText(/^No valid tripod position for S\d+ there: .*Nothing was moved\.$/).waitFor();
  expect((await viewer.review()).revision).toBe(together);
  await viewer.dragFrom(await viewer.centreOf(a.id), 0.27 * pixelsPerM, 0.18 * pixelsPerM, 2);
  await page.mouse.up();
  await expect.poll(async () => (await shifts())[1]).not.toBeNull();
  const [ofA, ofB] = await shifts();
  expect(ofA).toEqual(ofB!.map((m) => expect.closeTo(m, 2)));
  expect(Math.hypot(ofA![0], ofA![1])).toBeGreaterThan(0.05);
  await viewer.undo();
  await page.getByRole('button', { name: 'Lock', exact: true }).click();
  await expect.poll(() => nEdits('locked')).toBe(2);
  await viewer.undo();
  await page.keyboard.press('Delete');
  await expect.poll(() => nEdits('removed')).toBe(2);
  await viewer.screenshot('journey-3-removed');
  await viewer.undo();
  await page.keyboard.press('Escape');
  await expect.poll(() => page.getByRole('heading', { name: /stations? selected/ }).count()).toBe(0);
});

test('the site is edited: an entrance where the route begins, and doors open or shut in the next plan', async () => {
  // In a smaller picture bars lie over the last station and over doors.
  const viewer = await openPage({ width: 1280, height: 800 });
  const { page } = viewer;
  await viewer.openEditing(`floor=${ground.id}`, 'p');
  // Messages take their room from the picture: points are looked up for every click.
  const onPage = async (x: number, y: number): Promise<PagePoint> => (await viewer.planToPage(stations))(x, y);
  const last = onFloor.at(-1)!;
  const entrances = async (): Promise<string[]> => Object.keys((await viewer.review()).entrances);
  await viewer.tool('Entrance');
  const at = await onPage(last.position[0] + 0.35, last.position[1]);
  const before = (await viewer.canvasPixels()).at(...at);
  await page.mouse.click(...at);
  await expect.poll(entrances).toEqual(['E001']);
  const { E001: entrance } = (await viewer.review()).entrances;
  const [x, y, z] = entrance.position_m;
  expect(entrance.floor).toBe(ground.id);
  expect(Math.hypot(x - last.position[0] - 0.35, y - last.position[1])).toBeLessThan(0.15);
  expect(z).toBeCloseTo(ground.elevation_m, 1);
  await page.getByText('the route begins here').waitFor();
  await viewer.settle();
  expect((await viewer.canvasPixels()).at(...at)).not.toEqual(before);
  const answer = page.waitForResponse((response) => response.url().endsWith('api/live/route'));
  await page.getByRole('tab', { name: 'Plan' }).click();
  const { route } = (await (await answer).json()) as DraftRoute;
  const length = page.locator('.section-head', { hasText: 'Route' }).locator('.muted');
  await expect.poll(() => length.textContent()).toBe(`${route!.length_m.toFixed(0)} m`);
  await page.getByLabel('Show route').check();
  await expect.poll(() => length.textContent()).toBe(`${route!.length_m.toFixed(0)} m`);
  expect(Math.hypot(route!.start![0] - x, route!.start![1] - y)).toBeLessThan(0.3);
  expect(route!.legs[0].to).toBe(last.id);
  await viewer.settle();
  await viewer.screenshot('journey-4-route');
  await page.getByRole('tab', { name: 'Edit' }).click();
  await page.getByRole('button', { name: 'Remove: Entrance' }).click();
  await expect.poll(entrances).toEqual([]);
  await page.keyboard.press('Control+z');
  await expect.poll(entrances).toEqual(['E001']);
  await page.keyboard.press('Control+Shift+z');
  await expect.poll(entrances).toEqual([]);

  const stage = readStage(Uint8Array.from(files.bytes('stage.usdc')).buffer);
  const [one, other] = doorsOf(stage).filter(({ element }) => element.floorId === ground.id);
  const click = async ({ lowM, highM }: Door): Promise<void> => {
    const [middleX, middleY] = [0, 1].map((k) => (lowM[k] + highM[k]) / 2 + stage.offsetM[k]);
    await page.mouse.click(...(await onPage(middleX, middleY)));
  };
  const marked = async (): Promise<Record<string, string>> => (await viewer.review()).doors;
  const [oneId, otherId] = [one.element.sourceId, other.element.sourceId];
  await viewer.tool('Doors');
  await page.getByText('Live figures take doors as planned until you plan again.').waitFor();
  const figures = await page.getByTestId('totals').textContent();
  await click(one);
  await expect.poll(marked).toEqual({ [oneId]: 'open' });
  await page.getByTestId('doors-note').waitFor();
  const changes = page.getByRole('list', { name: 'Changes' }).locator('li');
  await expect
    .poll(() => changes.allTextContents())
    .toEqual([`${one.element.name}: openin the next plan, ${ground.name}As planned`]);
  await click(one);
  await page.getByText('This door is marked as open already.').waitFor();
  await viewer.tool('Shut');
  await click(one);
  await expect.poll(marked).toEqual({ [oneId]: 'shut' });
  await click(other);
  await expect.poll(marked).toEqual({ [oneId]: 'shut', [otherId]: 'shut' });
  await viewer.screenshot('journey-4-doors');
  await expect.poll(() => page.getByTestId('totals').textContent()).toBe(figures);
  await page.keyboard.press('Control+z');
  await expect.poll(marked).toEqual({ [oneId]: 'shut' });
  await page.keyboard.press('Control+z');
  await expect.poll(marked).toEqual({ [oneId]: 'open' });
  await page.getByRole('button', { name: /^As planned: / }).click();
  await expect.poll(marked).toEqual({});
  await page.getByTestId('doors-note').waitFor({ state: 'detached' });
});

test('a plan is reviewed: comments and verdicts by a limited link, and the sign-off with open points', async () => {
  const limited = await openPage({}, inject('commentAddress'));
  await limited.open();
  const manager = limited.page;
  for (const name of ['Edit', 'Runs']) {
    await manager.getByRole('tab', { name }).click();
    await expect.poll(() => manager.locator('.tab-page .callout').textContent()).toMatch(/for comments and verdicts/);
  }
  await manager.getByRole('tab', { name: 'Review' }).click();
  await manager.getByLabel('Your name').fill('Site manager');
  await manager.getByRole('textbox', { name: 'New comment' }).fill('The hall is full until Friday.');
  await manager.getByRole('button', { name: 'Comment', exact: true }).click();
  await manager.getByText('The hall is full until Friday.').first().waitFor();
  await manager.getByRole('button', { name: `Reject ${second.id}`, exact: true }).click();
  const rejected = /rejected by Site manager/;
  await manager.getByText(rejected).first().waitFor();
  await expect.poll(() => manager.getByRole('button', { name: /^Sign off/ }).count()).toBe(0);
  await limited.screenshot('journey-5-limited');
  expect(await limited.changeAs('Site manager', { kind: 'remove_station', station: first.id })).toBe(403);
  // The browser itself notes the refusal.
  expect(limited.faults.splice(0)).toEqual([expect.stringContaining('403')]);
  await manager.close();

  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#tab=review');
  await page.getByText(rejected).first().waitFor();
  await page.getByLabel('Your name, for changes and comments').fill('Grace');
  await page.getByRole('button', { name: `Accept ${first.id}`, exact: true }).click();
  await expect
    .poll(async () => (await viewer.review()).verdicts[first.id])
    .toMatchObject({ verdict: 'accepted', by: 'Grace' });
  await page.getByRole('button', { name: /^Accept the other/ }).click();
  await expect.poll(async () => Object.keys((await viewer.review()).verdicts).length).toBe(plan.stations.length);
  expect((await viewer.review()).verdicts[second.id]).toMatchObject({ verdict: 'rejected', by: 'Site manager' });
  const points = page.getByRole('list', { name: 'Open points' });
  await expect.poll(() => points.textContent()).toContain(`${second.id} is rejected and still in the plan`);
  await expect.poll(() => points.textContent()).toMatch(/comments? (is|are) open/);
  const signing = page.getByRole('button', { name: 'Sign off as Grace' });
  const agreeing = page.getByLabel(/^Sign off with th/);
  await expect.poll(() => signing.isDisabled()).toBe(true);
  await agreeing.check();
  await viewer.screenshot('journey-5-open-points');
  // Whoever agreed to some open points has to agree again when there are more.
  const [x, y] = stations[2].position;
  const outline = [
    [-0.5, -0.5],
    [0.5, -0.5],
    [0.5, 0.5],
    [-0.5, 0.5],
  ].map(([dx, dy]): [number, number] => [x + dx, y + dy]);
  const zone = addZone({ kind: 'keep_out', outline, floor: ground.id, name: '', coverage: null });
  expect(await viewer.changeAs('Ada', zone)).toBe(200);
  await expect.poll(() => points.textContent()).toContain('keep-out zone');
  await expect.poll(() => signing.isDisabled()).toBe(true);
  await agreeing.check();
  await signing.click();
  const signature = page.getByTestId('signature');
  await signature.waitFor();
  await expect.poll(() => signature.textContent()).toMatch(/Grace signed off on .*No changes since/);
  expect(await viewer.changeAs('Ada', { kind: 'lock_station', station: first.id, locked: true })).toBe(200);
  await expect.poll(() => signature.textContent()).toContain('1 change since');
});

test('a run is started, watched, opened, compared and deleted', { timeout: 1_500_000 }, async () => {
  const viewer = await openPage();
  const { page } = viewer;
  await viewer.open('#tab=edit');
  const tab = (name: string): Promise<void> => page.getByRole('tab', { name }).click();
  const runs = (): Promise<Run[]> => page.evaluate(async () => (await (await fetch('api/runs')).json()).runs);
  const markers = page.locator('.marker');
  await viewer.marker(first.id).click();
  await page.getByRole('button', { name: 'Lock', exact: true }).click();
  const undo = page.getByRole('button', { name: /^Undo: lock/ });
  await undo.waitFor();
  await tab('Runs');
  await page.getByRole('textbox', { name: 'Title' }).fill('Ground floor, seven stations');
  await page.getByRole('combobox', { name: 'Objective' }).selectOption('coverage');
  await page.getByRole('textbox', { name: /^Stations/ }).fill('7');
  await page.getByText('More requirements').click();
  await page.getByRole('checkbox', { name: 'Upper floor' }).uncheck();
  await page.getByRole('textbox', { name: /^Time limit/ }).fill('5');
  await page.getByRole('button', { name: 'Start' }).click();
  await expect.poll(() => page.locator('[data-run]').count()).toBe(1);
  const [{ id }] = await runs();
  const card = page.locator(`[data-run="${id}"]`);
  const goOn = await holdAtItsBest(id);
  // Its best stations so far take the place of the plan's, and the page states it.
  const banner = page.getByRole('status', { name: 'Shown stations' });
  try {
    await banner.getByText(`Showing the best stations of run ${id} so far`).waitFor();
    await expect.poll(() => markers.count()).toBe(7);
    await expect.poll(() => page.getByLabel('Chosen station').count()).toBe(0);
    await viewer.screenshot('journey-6-running');
    await banner.getByRole('button', { name: 'Back to the plan' }).click();
    await expect.poll(() => markers.count()).toBe(plan.stations.length);
    await page.getByLabel('Chosen station').waitFor();
    await banner.getByRole('button', { name: 'Watch the run' }).click();
    await expect.poll(() => markers.count()).toBe(7);
  } finally {
    goOn();
  }
  await expect.poll(() => card.getAttribute('data-state'), { timeout: RUN_MS }).toBe('finished');
  await expect.poll(() => card.getByTestId('run-best').textContent()).toMatch(/\d+ stations?/);
  await expect.poll(() => banner.count()).toBe(0);
  await card.getByRole('button', { name: 'Compare' }).click();
  await page.getByTestId('comparison').waitFor();
  await expect.poll(() => page.locator('.legend').textContent()).toContain(`seen only in Run ${id}`);
  await viewer.screenshot('journey-6-compared');

  // Another plan is another page: until it is there, this one's markers stay.
  const opened = page.waitForEvent('load');
  await card.getByRole('link', { name: 'Open' }).click();
  await opened;
  await expect.poll(() => viewer.hash()).toContain('plan=runs');
  await page.locator('.marker:not([hidden])').first().waitFor();
  const [run] = await runs();
  await expect.poll(() => markers.count()).toBe(run.best?.n_stations);
  await tab('Edit');
  await page.getByText('This is the plan of a run').waitFor();
  await banner.getByText(`Showing run ${id}, Ground floor, seven stations: 7 stations`).waitFor();
  const back = page.waitForEvent('load');
  await banner.getByRole('link', { name: 'Back to the plan' }).click();
  await back;
  await expect.poll(() => markers.count()).toBe(plan.stations.length);
  await tab('Edit');
  await undo.click();
  await undo.waitFor({ state: 'detached' });
  await tab('Runs');
  await card.getByRole('button', { name: 'Delete' }).click();
  await card.getByRole('button', { name: 'Really delete?' }).click();
  await expect.poll(() => page.locator('[data-run]').count()).toBe(0);
});

/** Stop a run's process as soon as it has stations: on a busy machine it might end before the page shows them. */
async function holdAtItsBest(id: string): Promise<() => void> {
  const written = (file: string) => JSON.parse(readFileSync(join(planFolder, 'runs', file), 'utf8'));
  await expect.poll(() => written(`${id}/run.json`).best, { timeout: RUN_MS, interval: 20 }).not.toBeNull();
  const { run, pid } = written('.turn') as { run: string; pid: number };
  expect(run).toBe(id);
  process.kill(pid, 'SIGSTOP');
  return () => process.kill(pid, 'SIGCONT');
}

test('a plan is handed over: station list, issues and sheets, and a copy on a static host', async () => {
  const viewer = await openPage();
  const { page } = viewer;
  const folder = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-handed-over-'));
  await viewer.open();
  await page.getByRole('button', { name: 'Share' }).click();
  const menu = page.getByRole('region', { name: 'Share and download' });
  for (const [name, file, beginning] of [
    ['Station list', 'stations.csv', 'name,easting_m'],
    ['Issues', 'issues.bcfzip', 'PK'],
    ['Sheets to print', 'sheets.pdf', '%PDF-'],
  ]) {
    const [download] = await Promise.all([page.waitForEvent('download'), menu.getByRole('button', { name }).click()]);
    expect(download.suggestedFilename()).toBe(file);
    await download.saveAs(join(folder, file));
    expect(readFileSync(join(folder, file)).toString('latin1').slice(0, beginning.length)).toBe(beginning);
  }
  await page.close();

  const root = join(folder, 'host');
  execFileSync(
    PYTHON,
    ['-m', 'tlsplan', 'export', planFolder, '--format', 'web', '-o', `${root}/clients/house`, '--quiet'],
    {
      cwd: REPOSITORY,
    },
  );
  const host = await serveStatic(root);
  try {
    const copy = await openPage({}, `${host.address}clients/house/`);
    const requested: string[] = [];
    copy.page.on('request', (request) => requested.push(new URL(request.url()).pathname));
    await copy.open();
    await copy.page.locator('html[data-offline=ready]').waitFor({ state: 'attached' });
    expect(requested.filter((path) => !path.startsWith('/clients/house/') || path.includes('/api/'))).toEqual([]);
    await copy.screenshot('journey-7-copy');
    await copy.page.close();
  } finally {
    await host.stop();
    rmSync(folder, { recursive: true, force: true });
  }
});

test('on site a German tablet has German texts that fit, fingers drag a station, and stations follow one another', async () => {
  const viewer = await openPage({ width: 1024, height: 768, locale: 'de-DE', hasTouch: true });
  const { page } = viewer;
  const titles = ['Plan', 'Lücken', 'Netz', 'Ändern', 'Läufe', 'Prüfung'];
  await viewer.open();
  await expect.poll(() => page.locator('html').getAttribute('lang')).toBe('de');
  await expect.poll(() => page.getByRole('tab').allTextContents()).toEqual(titles);
  await expect.poll(() => page.getByTestId('coverage').textContent()).toMatch(/^\d+,\d %$/);
  const cut: Record<string, string[]> = {};
  for (const title of titles) {
    await page.getByRole('tab', { name: title, exact: true }).click();
    await viewer.settle();
    cut[title] = await cutOff(page);
  }
  expect(cut).toEqual(Object.fromEntries(titles.map((title) => [title, []])));

  await viewer.openEditing(`floor=${ground.id}`);
  const { revision } = await viewer.review();
  const [x, y] = await viewer.centreOf(first.id);
  await viewer.touch('touchStart', [x, y]);
  for (let i = 1; i <= 4; i++) await viewer.touch('touchMove', [x + 18 * i, y + 10 * i]);
  await viewer.screenshot('journey-8-dragging');
  await viewer.touch('touchEnd');
  const edited = await viewer.changedFrom(revision);
  expect(edited.stations[first.id].position_m).not.toEqual(first.position);
  await viewer.settle();
  const [movedX, movedY] = await viewer.centreOf(first.id);
  expect(Math.hypot(movedX - x, movedY - y)).toBeGreaterThan(15);
  await page.getByRole('button', { name: new RegExp(`^Rückgängig: .*${first.id}`) }).tap();
  await expect.poll(async () => Object.keys((await viewer.review()).stations)).toEqual([]);

  const stops = routeStops(plan, draftStations(plan, null));
  const reads = (id: string, words: string): Promise<void> =>
    expect.poll(() => page.getByTestId(id).textContent()).toBe(words);
  await page.setViewportSize({ width: 768, height: 1024 });
  await page.goto(`${inject('address')}#view=field`);
  for (const [i, stop] of stops.slice(0, 3).entries()) {
    await reads('field-number', String(stop.number));
    await reads('field-station', stop.stationId);
    const way = page.getByTestId('field-way');
    if (i > 0 && stop.wayM! > 0) await expect.poll(() => way.textContent()).toMatch(/^noch \d+(,\d)?\sm$/);
    await page.getByRole('button', { name: 'Erledigt', exact: true }).tap();
    await reads('field-count', `${i + 1} von ${stops.length}`);
  }
  await viewer.screenshot('journey-8-field');
});

/** Texts that reach out of what shows them, or of the page. */
function cutOff(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const hasWords = (element: Element): boolean =>
      [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && /\S/.test(node.textContent ?? ''));
    /** Names of the plan's things may end in dots. */
    const mayEnd = (element: Element): boolean => element.closest('.row-name, .row-place, .brand, .own li') !== null;
    const isCut = (element: Element): boolean => {
      if (!hasWords(element) || element.closest('.markers, svg, select, .row-name') !== null) return false;
      const box = element.getBoundingClientRect();
      if (box.width === 0 || getComputedStyle(element).visibility === 'hidden') return false;
      const frame = element.closest('.sidebar')?.getBoundingClientRect() ?? { left: 0, right: window.innerWidth };
      const isOut = box.right > frame.right + 1 || box.left < frame.left - 1;
      return isOut || (element.scrollWidth > element.clientWidth + 1 && element.clientWidth > 0 && !mayEnd(element));
    };
    const wide = document.documentElement.scrollWidth > window.innerWidth ? ['the page'] : [];
    return [
      ...wide,
      ...[...document.body.querySelectorAll('*')].filter(isCut).map((one) => `${one.className}: ${one.textContent}`),
    ];
  });
}
