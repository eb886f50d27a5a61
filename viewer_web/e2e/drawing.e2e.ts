/** A drawing from start to end: planned by the command, corrected in a browser, saved, and planned again from there. */
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import type { Drawn } from '../src/api/documents.ts';
import type { PlanJson } from '../src/load/plan-json.ts';
import { viewerPages } from './browser.ts';
import { type PlanServer, PYTHON, REPOSITORY, servePlan } from './plan-server.ts';

const openPage = viewerPages({ width: 1200, height: 760 });
let root: string;
let server: PlanServer;

/** Two rooms with three gaps where doors and a window would be: 6.5 by 4.4 m. */
beforeAll(async () => {
  root = mkdtempSync(join(tmpdir(), 'tlsplan-drawing-'));
  const python = (...words: readonly string[]): Buffer =>
    execFileSync(PYTHON, words, { cwd: REPOSITORY, stdio: ['ignore', 'ignore', 'inherit'] });
  const drawing = join(root, 'house.dxf');
  const draw = 'import pathlib, sys; from tests.drawings.drawn_buildings import draw_two_rooms as draw';
  python('-c', `${draw}; draw(pathlib.Path(sys.argv[1]), symbols=False)`, drawing);
  const coarse = ['--grid', '1', '--coverage', '80', '--patch-area', '0.2', '--set', 'work_limit=0.1', '--verify', '0'];
  python('-m', 'tlsplan', 'plan', drawing, '-o', join(root, 'plan'), '--quiet', ...coarse);
  server = await servePlan(join(root, 'plan'));
});
afterAll(async () => {
  await server?.stop();
  rmSync(root, { recursive: true, force: true });
});

const drawn = (folder = root): Drawn => JSON.parse(readFileSync(join(folder, 'plan.drawing.json'), 'utf8')) as Drawn;

test('gaps get a door and a wall, a wall is drawn, north is set, and all of it is planned again', async () => {
  const viewer = await openPage({}, server.address);
  const { page } = viewer;
  await viewer.open();
  await page.getByRole('button', { name: /^Correct the drawing/ }).click();
  const canvas = page.locator('.drawing-canvas');
  const saved = page.getByTestId('drawing-saving');
  await expect.poll(() => page.locator('.drawing-names text').count()).toBe(2);
  await expect.poll(() => page.locator('.drawing-lines').getAttribute('d')).toMatch(/^M/);

  await page.getByRole('button', { name: 'Gap O3' }).click();
  await page.getByRole('group', { name: 'Kind' }).getByRole('button', { name: 'Wall' }).click();
  await page.getByRole('button', { name: 'Gap O2' }).click();
  await page.getByRole('button', { name: 'Door', exact: true }).click();
  await expect
    .poll(() => drawn().storeys[0].openings.map(({ kind, doubtful }) => [kind, doubtful]))
    .toEqual([
      ['passage', true],
      ['door', false],
    ]);

  // From wall to wall through the first room, by clicks beside its middle: ends are on the walls, at a right angle.
  const plan = await page.evaluate(() => {
    const [perM, , , , x, y] = document
      .querySelector('.drawing-canvas > g')!
      .getAttribute('transform')!
      .match(/-?[\d.]+(e-?\d+)?/g)!
      .map(Number);
    return { perM, x, y };
  });
  const box = (await canvas.boundingBox())!;
  const at = (x: number, y: number): [number, number] => [
    box.x + plan.x + plan.perM * x,
    box.y + plan.y - plan.perM * y,
  ];
  await page.getByRole('radio', { name: 'Wall' }).click();
  await page.mouse.click(...at(0.11, 3.02));
  await page.mouse.click(...at(3.22, 3.05));
  await page.keyboard.press('Escape');
  await expect.poll(() => page.locator('.drawing-names text').count()).toBe(3);
  await page.getByRole('radio', { name: 'North' }).click();
  await page.mouse.click(...at(1, 1));
  await page.mouse.click(...at(2, 1));
  await page.getByTestId('drawing-north').waitFor();
  await page.getByRole('textbox', { name: 'Wall height, m' }).fill('3');
  await page.keyboard.press('Enter');

  const rooms = page.getByRole('textbox', { name: /^Room / });
  await rooms.first().fill('7 Kitchen');
  await page.keyboard.press('Enter');
  await expect.poll(() => page.locator('.drawing-names').textContent()).toContain('7 Kitchen');

  // Taken back and done again by keys, a door is deleted and comes back.
  await page.locator('[data-id="O2"]').click();
  await page.keyboard.press('Delete');
  await expect.poll(() => drawn().storeys[0].openings.length).toBe(1);
  await page.keyboard.press('Control+z');
  await expect.poll(() => drawn().storeys[0].openings.length).toBe(2);
  await expect.poll(() => saved.textContent()).toBe('Saved');
  const [storey] = drawn().storeys;
  const added = storey.walls.at(-1)!.outline.map(([, y]) => y);
  expect(Math.max(...added) - Math.min(...added)).toBeCloseTo(0.2, 3);
  expect([drawn().north_deg, storey.room_height_m]).toEqual([90, 3]);

  // Another start of the page shows what was saved; a second page that is late is refused.
  const late = await openPage({}, server.address);
  await late.page.goto(`${server.address}#view=drawing`);
  await late.page.locator('.drawing-names text').nth(2).waitFor();
  await page.getByRole('textbox', { name: 'Name' }).fill('Ground');
  await page.keyboard.press('Enter');
  await expect.poll(() => drawn().storeys[0].name).toBe('Ground');
  await late.page.locator('[data-id="O1"]').click();
  await late.page.getByRole('button', { name: 'Passage', exact: true }).click();
  await late.page.getByText(/another page saved corrections meanwhile/).waitFor();
  await late.page.getByRole('button', { name: 'Load the newer ones' }).click();
  await expect.poll(() => late.page.getByRole('textbox', { name: 'Name' }).inputValue()).toBe('Ground');
  expect(late.faults.splice(0).filter((fault) => !/409/.test(fault))).toEqual([]);

  await page.getByRole('button', { name: 'Plan again' }).click();
  const run = page.locator('[data-run]');
  await expect.poll(() => run.getAttribute('data-state')).toBe('finished');
  const folder = join(root, 'plan', 'runs', 'R001');
  expect(drawn(folder)).toEqual(drawn());
  expect(existsSync(join(folder, 'plan.ifc'))).toBe(true);
  const again = JSON.parse(readFileSync(join(folder, 'plan', 'plan.json'), 'utf8')) as PlanJson;
  expect(again.floors.map(({ name }) => name)).toEqual(['Ground']);
  expect(again.scene.file).toBe('plan.ifc');
});
