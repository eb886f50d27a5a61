/** Editing in a real browser: where a tripod can stand, zones, marks on the ground, everything taken back. */
import type { Locator } from 'playwright-core';
import { beforeEach, expect, inject, test } from 'vitest';
import { readFramed } from '../src/api/framing.ts';
import { GROUND, GroundMap as Ground, type GroundMap } from '../src/edit/ground-map.ts';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';

const { plan, ground: floor, stationsOf } = new PlanFiles(inject('planFolder'));
const stations = stationsOf(floor.id);
const [first, second] = stations;

const openPage = viewerPages({ width: 960, height: 600 });
let viewer: ViewerPage;
beforeEach(async () => {
  viewer = await openPage();
  await viewer.openEditing(`floor=${floor.id}`);
});

const changes = (): Locator => viewer.page.getByRole('list', { name: 'Changes' }).locator('li');

async function ground(): Promise<GroundMap> {
  const bytes = await viewer.page.evaluate(async (id) => {
    const answer = await fetch(`api/live/ground/${id}`);
    return [...new Uint8Array(await answer.arrayBuffer())];
  }, floor.id);
  const { head, body } = readFramed<GroundMap['head']>(Uint8Array.from(bytes).buffer);
  return new Ground(head, new Uint8Array(body));
}

test('a station dragged out of the building stops where a tripod can stand, beside the plan as it was made', async () => {
  const { page } = viewer;
  const { revision } = await viewer.review();
  await viewer.dragFrom(await viewer.centreOf(first.id), -420, -240, 4);
  await page.mouse.up();
  const { position_m } = (await viewer.changedFrom(revision)).stations[first.id];
  expect((await ground()).at([position_m![0], position_m![1]])).toBe(GROUND.admissible);
  await page.getByRole('radio', { name: 'As planned' }).click();
  await viewer.settle();
  await expect.poll(() => viewer.marker(first.id).getAttribute('class')).not.toContain('marker-moved');
  await page.getByRole('radio', { name: /^Edited/ }).click();
  await page.getByRole('tab', { name: 'Runs' }).click();
  await page.getByLabel('The edited plan compared with').selectOption('');
  const rows = page.getByTestId('comparison').locator('tbody tr');
  await rows.first().waitFor();
  await expect.poll(() => rows.first().textContent()).toContain(String(plan.stations.length));
  await expect.poll(() => page.locator('.legend').textContent()).toContain('gained');
  await page.getByRole('tab', { name: 'Plan' }).click();
  await page.locator(`.rows [data-station="${first.id}"]`).click();
  await cardShows(first.id, position_m!, 'moved');
});

test('a station is locked, removed and restored, and one is added where the ground is clicked', async () => {
  const { page } = viewer;
  const { id } = second;
  await viewer.marker(id).click();
  await page.getByRole('button', { name: 'Lock', exact: true }).click();
  await expect.poll(async () => (await viewer.review()).stations[id]?.locked).toBe(true);
  const remove = page.getByRole('button', { name: 'Remove', exact: true });
  await expect.poll(() => remove.isDisabled()).toBe(true);
  await page.keyboard.press('Delete');
  await page.getByText(`${id} is locked: unlock it first`).waitFor();
  await page.getByRole('button', { name: 'Unlock', exact: true }).click();
  await remove.click();
  await expect.poll(() => viewer.marker(id).count()).toBe(0);
  expect((await viewer.review()).stations[id].removed).toBe(true);
  await page.getByRole('button', { name: `Restore: ${id} removed` }).click();
  await expect.poll(() => viewer.marker(id).count()).toBe(1);

  await viewer.tool('Add station');
  const { revision } = await viewer.review();
  const [x, y] = await viewer.centreOf(first.id);
  // Where the first point is furniture or too close to a wall, no station is added, and another point is tried.
  for (const [dx, dy] of [
    [45, 45],
    [-45, 45],
    [60, 0],
    [-60, 10],
    [0, 60],
  ]) {
    if (!(await viewer.isBare(x + dx, y + dy))) continue;
    await page.mouse.click(x + dx, y + dy);
    const refused = page.getByRole('alert');
    await expect
      .poll(async () => (await viewer.review()).revision !== revision || (await refused.count()) > 0)
      .toBe(true);
    if ((await refused.count()) === 0) break;
    await refused.getByRole('button', { name: 'Dismiss' }).click();
  }
  const added = Object.entries((await viewer.changedFrom(revision)).stations).filter(([, edit]) => edit.added);
  expect(added).toHaveLength(1);
  const [[addedId, { position_m }]] = added;
  expect((await ground()).at([position_m![0], position_m![1]])).toBe(GROUND.admissible);
  await expect.poll(() => viewer.marker(addedId).count()).toBe(1);
  await expect.poll(() => page.getByTestId('totals').textContent()).toContain(`${plan.stations.length + 1}`);
  await viewer.marker(addedId).click();
  await cardShows(addedId, position_m!, 'added');
});

/** The card of a station has it where it was put. */
async function cardShows(id: string, positionM: readonly number[], state: string): Promise<void> {
  const { page } = viewer;
  await page.getByRole('tab', { name: 'Plan' }).click();
  const card = page.getByRole('complementary', { name: 'Chosen station' });
  await card.getByText(`Station ${id}`).waitFor();
  await expect.poll(() => card.textContent()).toContain(state);
  const [x, y, z] = positionM.map((value) => `${value.toFixed(3)} m`);
  await expect.poll(() => viewer.figures('station-figures')).toMatchObject({ x, y, z });
  await expect.poll(async () => (await viewer.figures('station-figures'))['Seen area']).toMatch(/^\d+\.\d m²$/);
}

test('zones are drawn corner by corner: a keep-out bars stations, a priority zone has its share, none crosses itself', async () => {
  const { page } = viewer;
  let { revision } = await viewer.review();
  const drawAround = async (id: string, corners: readonly (readonly [number, number])[]): Promise<void> => {
    const [x, y] = await viewer.centreOf(id);
    for (const [dx, dy] of corners) await page.mouse.click(x + dx, y + dy);
  };
  await viewer.tool('Keep-out');
  await page.getByRole('textbox', { name: 'Name', exact: true }).fill('Wet floor');
  await drawAround(first.id, [
    [-40, -40],
    [40, -39],
    [40, 41],
    [-40, 40],
  ]);
  await page.getByText('4 corners').waitFor();
  await page.keyboard.press('Enter');
  const kept = await viewer.changedFrom(revision);
  expect(Object.values(kept.zones)[0].outline_m).toHaveLength(4);
  expect((await ground()).at([first.position[0], first.position[1]])).toBe(GROUND.keptOut);
  await page.getByText('Wet floor').waitFor();

  revision = kept.revision;
  await viewer.tool('Priority');
  await drawAround(stations[2].id, [
    [-30, -30],
    [30, 30],
    [30, -30],
    [-30, 34],
  ]);
  await page.getByText('The outline crosses itself').waitFor();
  await expect.poll(() => page.getByRole('button', { name: 'Finish' }).isDisabled()).toBe(true);
  await page.keyboard.press('Backspace');
  await page.getByText('3 corners').waitFor();
  const share = page.getByRole('textbox', { name: /^Required coverage/ });
  await share.fill('97');
  await share.press('Enter');
  const zones = Object.values((await viewer.changedFrom(revision)).zones);
  expect(zones).toContainEqual(expect.objectContaining({ kind: 'priority', coverage: 0.97 }));
});

test('positions are forbidden, ground is marked, and all changes are discarded', async () => {
  const { page } = viewer;
  const { revision } = await viewer.review();
  const [x, y] = await viewer.centreOf(first.id);
  await viewer.tool('Forbid position');
  await page.mouse.click(x + 40, y + 40);
  const forbidden = await viewer.changedFrom(revision);
  expect(Object.values(forbidden.forbidden)[0]).toMatchObject({ radius_m: 0.5, floor: floor.id });
  await viewer.tool('Floor surface');
  await page.getByRole('radio', { name: 'Not a floor' }).click();
  const question = page.getByRole('alertdialog');
  await page.mouse.click(x - 45, y + 25);
  await question.getByText(new RegExp(`on this floor: .*${first.id}`)).waitFor();
  await question.getByRole('button', { name: 'Cancel' }).click();
  expect((await viewer.review()).ground_picks).toEqual({});
  await page.mouse.click(x - 45, y + 25);
  await question.getByRole('button', { name: 'Not a floor' }).click();
  const picked = await viewer.changedFrom(forbidden.revision);
  expect(Object.values(picked.ground_picks)[0]).toMatchObject({ is_ground: false, floor: floor.id });
  await expect.poll(() => changes().count()).toBe(2);
  await viewer.settle();
  await viewer.screenshot('edit-marked');
  await page.getByRole('button', { name: 'Discard all changes' }).click();
  await expect.poll(() => changes().count()).toBe(0);
});

test('messages, bars, cards and a panorama each have a place of their own, on small screens too', async () => {
  const { page } = viewer;
  const [x, y, z] = first.position;
  // Without events this page does not learn of the other's change, and is in its way.
  await page.route('**/api/events*', (route) => route.abort());
  await page.reload();
  await page.getByTestId('trouble').waitFor();
  await viewer.changeAs('Ben', { kind: 'move_station', station: first.id, position_m: [x + 0.1, y, z] });
  await viewer.marker(first.id).click();
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
    await viewer.screenshot(`edit-places-${width}x${height}`);
    expect(await overlaps(['.sidebar', '.messages', '.draft-bar', '.scene', '.sheet-panorama'])).toEqual([]);
    expect(await overlaps(['.toolbar', '.legend', '.cards'])).toEqual([]);
    await expect.poll(() => page.getByRole('button', { name: 'Keep theirs' }).isVisible()).toBe(true);
  }
  await page.getByRole('button', { name: 'Keep theirs' }).click();
  await page.unroute('**/api/events*');
  await page.getByTestId('trouble').waitFor({ state: 'detached' });
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
