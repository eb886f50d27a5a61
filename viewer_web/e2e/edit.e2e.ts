/** Editing in a real browser: a station dragged over its ground, zones drawn, everything taken back. */
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import type { Locator } from 'playwright-core';
import { afterEach, beforeEach, expect, inject, test } from 'vitest';
import type { Review } from '../src/api/documents.ts';
import { readFramed } from '../src/api/framing.ts';
import { GROUND, GroundMap as Ground, type GroundMap } from '../src/edit/ground-map.ts';
import { ViewerPage } from './browser.ts';
import { ownCopy } from './own-copy.ts';
import { PlanFiles } from './plan-files.ts';

const RESULTS = fileURLToPath(new URL('../test-results/', import.meta.url));
const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const floor = [...plan.floors].sort((a, b) => a.elevation_m - b.elevation_m)[0];
const stations = plan.stations.filter((station) => station.floor === floor.id);

const own = ownCopy(planFolder);
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await ViewerPage.create(own.browser, own.server.address, { width: 960, height: 600 });
  await viewer.open(`#floor=${floor.id}&tab=edit`);
  // First that there is a server, then that it is ready.
  await viewer.page.getByRole('radiogroup', { name: 'Tool' }).waitFor();
  await viewer.page.getByTestId('live-note').waitFor({ state: 'detached' });
  await viewer.page.getByTestId('totals').waitFor();
  await viewer.page.keyboard.press('t');
  await viewer.settle();
});
afterEach(async () => {
  await takeAllBack();
  await viewer.page.close();
  expect(viewer.faults).toEqual([]);
});

async function review(): Promise<Review> {
  return viewer.page.evaluate(async () => (await fetch('api/review')).json());
}
const marker = (id: string): Locator => viewer.page.locator(`.marker[data-station="${id}"]`);
const changes = (): Locator => viewer.page.getByRole('list', { name: 'Changes' }).locator('li');
const tool = (name: string): Promise<void> => viewer.page.getByRole('radio', { name, exact: true }).click();

async function centreOf(id: string): Promise<{ x: number; y: number }> {
  const box = (await marker(id).boundingBox())!;
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

/** Whether nothing lies over the canvas there. */
function isBare(x: number, y: number): Promise<boolean> {
  return viewer.page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS', [x, y]);
}

async function drag(id: string, dx: number, dy: number, steps = 6): Promise<void> {
  const { x, y } = await centreOf(id);
  await viewer.page.mouse.move(x, y);
  await viewer.page.mouse.down();
  for (let i = 1; i <= steps; i++) {
    await viewer.page.mouse.move(x + (dx * i) / steps, y + (dy * i) / steps);
    await viewer.settle();
  }
}

/** Wait until the review is at another revision than `revision`. */
async function changedFrom(revision: number): Promise<Review> {
  await expect.poll(async () => (await review()).revision).not.toBe(revision);
  return review();
}

async function ground(): Promise<GroundMap> {
  const bytes = await viewer.page.evaluate(async (id) => {
    const answer = await fetch(`api/live/ground/${id}`);
    return [...new Uint8Array(await answer.arrayBuffer())];
  }, floor.id);
  const { head, body } = readFramed<GroundMap['head']>(Uint8Array.from(bytes).buffer);
  return new Ground(head, new Uint8Array(body));
}

async function takeAllBack(): Promise<void> {
  for (let n = await changes().count(); n > 0; n = await changes().count()) {
    await changes().first().getByRole('button').last().click();
    await expect.poll(() => changes().count()).toBeLessThan(n);
  }
}

test('a dragged station shows what it would be worth, is kept, and goes back and forth', { tags: 'main' }, async () => {
  const before = await viewer.page.getByTestId('totals').textContent();
  const { revision } = await review();
  const [{ id }] = stations;
  const start = await centreOf(id);
  await drag(id, 70, 40, 20);
  await expect.poll(() => viewer.page.getByTestId('totals').textContent()).not.toBe(before);
  await viewer.screenshot('edit-1-dragging');
  await viewer.page.mouse.up();
  const edited = await changedFrom(revision);
  expect(edited.stations[id].position_m).not.toEqual(stations[0].position);
  await viewer.page.getByText(`${id} moved`).waitFor();
  await viewer.settle();
  const moved = await centreOf(id);
  expect(Math.hypot(moved.x - start.x, moved.y - start.y)).toBeGreaterThan(15);
  await viewer.screenshot('edit-2-moved');
  expect(await marker(id).getAttribute('class')).toContain('marker-moved');

  await viewer.page.keyboard.press('Control+z');
  await expect.poll(async () => (await review()).stations[id]?.position_m ?? null).toBeNull();
  await expect.poll(() => viewer.page.getByTestId('totals').textContent()).toBe(before);
  await viewer.page.keyboard.press('Control+Shift+z');
  await expect.poll(async () => (await review()).stations[id]?.position_m).toEqual(edited.stations[id].position_m);
  await writeLatencies();
});

/** For the record: nothing is asserted about time. */
async function writeLatencies(): Promise<void> {
  const bar = viewer.page.getByTestId('draft-bar');
  const summary: Record<string, { n: number; median_ms: number; p95_ms: number; ms: number[] }> = {};
  for (const what of ['answered', 'drawn']) {
    const ms = ((await bar.getAttribute(`data-${what}-ms`)) ?? '').split(' ').filter(Boolean).map(Number);
    const sorted = [...ms].sort((a, b) => a - b);
    const at = (q: number): number => sorted[Math.max(0, Math.ceil(q * sorted.length) - 1)];
    summary[what] = { n: ms.length, median_ms: at(0.5), p95_ms: at(0.95), ms };
    process.stdout.write(`previews ${what}: ${ms.length}, median ${at(0.5)} ms, 95 % within ${at(0.95)} ms\n`);
  }
  mkdirSync(RESULTS, { recursive: true });
  writeFileSync(join(RESULTS, 'latency.json'), `${JSON.stringify(summary)}\n`);
}

test('a station dragged out of the building stops where a tripod can stand', async () => {
  const { revision } = await review();
  const [{ id }] = stations;
  await drag(id, -420, -240, 4);
  await viewer.page.mouse.up();
  const { position_m } = (await changedFrom(revision)).stations[id];
  expect((await ground()).at([position_m![0], position_m![1]])).toBe(GROUND.admissible);
});

test('a station is locked, removed and brought back', async () => {
  const { id } = stations[1];
  await viewer.page.locator(`.marker[data-station="${id}"]`).click();
  await viewer.page.getByRole('button', { name: 'Lock', exact: true }).click();
  await expect.poll(async () => (await review()).stations[id]?.locked).toBe(true);
  await viewer.page.getByRole('button', { name: 'Remove', exact: true }).click();
  await expect.poll(() => marker(id).count()).toBe(0);
  expect((await review()).stations[id].removed).toBe(true);
  await viewer.page.getByRole('button', { name: `Restore: ${id} removed` }).click();
  await expect.poll(() => marker(id).count()).toBe(1);
});

test('a station is added where the ground is clicked', async () => {
  const { revision } = await review();
  await tool('Add station');
  const { x, y } = await centreOf(stations[0].id);
  // Where the first place is furniture or too near to a wall, no station is added: another is tried.
  for (const [dx, dy] of [
    [45, 45],
    [-45, 45],
    [60, 0],
    [-60, 10],
    [0, 60],
  ]) {
    if (!(await isBare(x + dx, y + dy))) continue;
    await viewer.page.mouse.click(x + dx, y + dy);
    const refused = viewer.page.getByRole('alert');
    await expect.poll(async () => (await review()).revision !== revision || (await refused.count()) > 0).toBe(true);
    if ((await refused.count()) === 0) break;
    await refused.getByRole('button', { name: 'Dismiss' }).click();
  }
  const added = Object.entries((await changedFrom(revision)).stations).filter(([, edit]) => edit.added);
  expect(added).toHaveLength(1);
  const [[id, { position_m }]] = added;
  expect((await ground()).at([position_m![0], position_m![1]])).toBe(GROUND.admissible);
  await expect.poll(() => marker(id).count()).toBe(1);
  await expect.poll(() => viewer.page.getByTestId('totals').textContent()).toContain(`${plan.stations.length + 1}`);
  await viewer.screenshot('edit-3-added');
  await tool('Move');
});

test('zones are drawn corner by corner, and keep stations out', async () => {
  const { revision } = await review();
  await tool('Keep-out');
  await viewer.page.getByRole('textbox', { name: 'Name', exact: true }).fill('Wet floor');
  const { x, y } = await centreOf(stations[0].id);
  const corners = [
    [-40, -40],
    [40, -40],
    [40, 40],
    [-40, 40],
  ];
  for (const [dx, dy] of corners) await viewer.page.mouse.click(x + dx, y + dy + (dx > 0 ? 1 : 0));
  await viewer.page.getByText('4 corners').waitFor();
  await viewer.screenshot('edit-4-drawing');
  await viewer.page.keyboard.press('Enter');
  const [zone] = Object.values((await changedFrom(revision)).zones);
  expect(zone).toMatchObject({ kind: 'keep_out', name: 'Wet floor', floor: floor.id });
  expect(zone.outline_m).toHaveLength(4);
  const [first] = stations;
  const { head, values } = await ground();
  const map = new Ground(head, values);
  expect(map.at([first.position[0], first.position[1]])).toBe(GROUND.keptOut);
  await viewer.page.getByText('Wet floor').waitFor();
  await viewer.screenshot('edit-5-zone');
});

test('a priority zone asks for its share, and an outline that crosses itself is not taken', async () => {
  const { revision } = await review();
  await tool('Priority');
  const { x, y } = await centreOf(stations[2 % stations.length].id);
  const at = (dx: number, dy: number): Promise<void> => viewer.page.mouse.click(x + dx, y + dy);
  await at(-30, -30);
  await at(30, 30);
  await at(30, -30);
  await at(-30, 34);
  await viewer.page.getByText('The outline crosses itself').waitFor();
  expect(await viewer.page.getByRole('button', { name: 'Finish' }).isDisabled()).toBe(true);
  await viewer.page.keyboard.press('Backspace');
  await viewer.page.getByText('3 corners').waitFor();
  const share = viewer.page.getByRole('textbox', { name: /^Required coverage/ });
  await share.fill('97');
  await share.press('Enter');
  const [zone] = Object.values((await changedFrom(revision)).zones);
  expect(zone).toMatchObject({ kind: 'priority', coverage: 0.97 });
});

test('places are forbidden, and ground is marked and unmarked', async () => {
  let { revision } = await review();
  const { x, y } = await centreOf(stations[0].id);
  await tool('Forbid position');
  await viewer.page.mouse.click(x + 40, y + 40);
  const forbidden = await changedFrom(revision);
  expect(Object.values(forbidden.forbidden)[0]).toMatchObject({ radius_m: 0.5, floor: floor.id });
  revision = forbidden.revision;
  await tool('Floor surface');
  await viewer.page.getByRole('radio', { name: 'Not a floor' }).click();
  await viewer.page.mouse.click(x - 45, y + 25);
  const picked = await changedFrom(revision);
  expect(Object.values(picked.ground_picks)[0]).toMatchObject({ is_ground: false, floor: floor.id });
  await expect.poll(() => changes().count()).toBe(2);
  await viewer.settle();
  await viewer.screenshot('edit-6-marked');
  await viewer.page.getByRole('button', { name: 'Discard all changes' }).click();
  await expect.poll(() => changes().count()).toBe(0);
});

test('the edited plan is set beside the plan as it was made', async () => {
  const { revision } = await review();
  await drag(stations[0].id, 60, 30, 4);
  await viewer.page.mouse.up();
  await changedFrom(revision);
  await viewer.page.getByRole('radio', { name: 'As planned' }).click();
  await viewer.settle();
  expect(await marker(stations[0].id).getAttribute('class')).not.toContain('marker-moved');
  await viewer.page.getByRole('radio', { name: /^Edited/ }).click();
  await viewer.page.getByRole('tab', { name: 'Runs' }).click();
  await viewer.page.getByLabel('The edited plan compared with').selectOption('');
  await viewer.page.getByTestId('comparison').waitFor();
  await viewer.settle();
  const rows = viewer.page.getByTestId('comparison').locator('tbody tr');
  expect(await rows.first().textContent()).toContain(String(plan.stations.length));
  await expect.poll(() => viewer.page.locator('.legend').textContent()).toContain('gained');
  await viewer.screenshot('edit-7-compared');
  await viewer.page.getByLabel('The edited plan compared with').selectOption('(nothing)');
  await viewer.page.getByRole('tab', { name: 'Edit' }).click();
});

test('messages, bars, cards and a panorama each have a place of their own, on small screens too', async () => {
  const { page } = viewer;
  const [{ id, position }] = stations;
  // Without the line this page does not hear of the other's change, and is in its way.
  await page.route('**/api/events', (route) => route.abort());
  await page.reload();
  await page.getByTestId('trouble').waitFor();
  await page.evaluate(
    async ([station, place]) => {
      const { revision } = await (await fetch('api/review')).json();
      const changes = [{ kind: 'move_station', station, position_m: place }];
      const body = JSON.stringify({ base_revision: revision, author: 'Ben', changes });
      await fetch('api/review/changes', { method: 'POST', headers: { 'content-type': 'application/json' }, body });
    },
    [id, [position[0] + 0.1, position[1], position[2]]] as const,
  );
  await page.locator(`.marker[data-station="${id}"]`).click();
  await page.getByRole('button', { name: 'Lock', exact: true }).click();
  await page.getByRole('alertdialog').waitFor();
  await page.getByRole('tab', { name: 'Plan' }).click();
  await page.getByRole('button', { name: 'Panorama' }).click();
  await page.locator('.panorama canvas').waitFor();
  for (const [width, height] of [
    [960, 600],
    [1280, 800],
    [1024, 768],
    [768, 1024],
  ]) {
    await page.setViewportSize({ width, height });
    await viewer.settle();
    await viewer.screenshot(`edit-8-places-${width}x${height}`);
    expect(await overlaps(['.sidebar', '.messages', '.draft-bar', '.scene', '.sheet-panorama'])).toEqual([]);
    expect(await overlaps(['.toolbar', '.legend', '.cards'])).toEqual([]);
    expect(await page.getByRole('button', { name: 'Keep theirs' }).isVisible()).toBe(true);
  }
  await page.getByRole('button', { name: 'Keep theirs' }).click();
  await page.unroute('**/api/events');
  await page.getByTestId('trouble').waitFor({ state: 'detached' });
  await page.getByRole('tab', { name: 'Edit' }).click();
  expect(viewer.faults.splice(0).filter((fault) => !/409|ERR_FAILED/.test(fault))).toEqual([]);
});

/** Pairs of parts of the page, all of which are there, that share pixels. */
async function overlaps(parts: readonly string[]): Promise<string[]> {
  const boxes = await Promise.all(parts.map(async (part) => (await viewer.page.locator(part).boundingBox())!));
  const share = (i: number, j: number, from: 'x' | 'y', size: 'width' | 'height'): boolean =>
    Math.min(boxes[i][from] + boxes[i][size], boxes[j][from] + boxes[j][size]) >
    Math.max(boxes[i][from], boxes[j][from]) + 0.5;
  const pairs = parts.flatMap((_, i) => parts.slice(i + 1).map((_, k) => [i, i + 1 + k] as const));
  return pairs
    .filter(([i, j]) => share(i, j, 'x', 'width') && share(i, j, 'y', 'height'))
    .map(([i, j]) => `${parts[i]} and ${parts[j]}`);
}
