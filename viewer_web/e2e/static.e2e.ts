/** The exported plan without network, exported anew, uploaded in part, and opened as a file. */
import { execFileSync } from 'node:child_process';
import { cpSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, test } from 'vitest';
import { type ViewerPage, viewerPages } from './browser.ts';
import { PlanFiles } from './plan-files.ts';
import { PYTHON, REPOSITORY, serveStatic } from './plan-server.ts';

const planFolder = inject('planFolder');
const { plan } = new PlanFiles(planFolder);
const openPage = viewerPages({ width: 960, height: 600 });

function exportTo(folder: string, from = planFolder): void {
  const command = ['-m', 'tlsplan', 'export', from, '--format', 'web', '-o', folder, '--overwrite', '--quiet'];
  execFileSync(PYTHON, command, { cwd: REPOSITORY, stdio: ['ignore', 'ignore', 'inherit'] });
}

let root: string;
let copy: string;
let server: Awaited<ReturnType<typeof serveStatic>>;
beforeAll(() => {
  root = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-static-'));
  copy = join(root, 'clients/house');
  exportTo(copy);
});
afterAll(() => rmSync(root, { recursive: true, force: true }));
beforeEach(async () => {
  server = await serveStatic(root);
});
afterEach(() => server.stop());

const openCopy = (locale = 'en'): Promise<ViewerPage> => openPage({ locale }, `${server.address}clients/house/`);
const isKept = ({ page }: ViewerPage): Promise<void> =>
  page.locator('html[data-offline=ready]').waitFor({ state: 'attached' });

test('an export that was opened once opens without network: clouds, downloads and the field view too', async () => {
  const viewer = await openCopy();
  const { page } = viewer;
  await viewer.open();
  await isKept(viewer);
  await server.stop();
  await page.goto('about:blank');
  await viewer.open('#floor=F0');
  const sizes = await page.evaluate(
    async (ids) =>
      Promise.all(ids.map(async (id) => (await (await fetch(`plan/viewer/clouds/${id}.cloud`)).blob()).size)),
    plan.stations.map(({ id }) => id),
  );
  expect(sizes.every((size) => size > 0)).toBe(true);
  await page.getByRole('button', { name: 'Share' }).click();
  const menu = page.getByRole('region', { name: 'Share and download' });
  const [download] = await Promise.all([
    page.waitForEvent('download'),
    menu.getByRole('link', { name: /Station list/ }).click(),
  ]);
  expect(download.suggestedFilename()).toBe('stations.csv');
  await expect
    .poll(() => menu.getByRole('link').allTextContents())
    .toEqual(['Station listCSV', 'Reportopens', 'Unseen elementsCSV', 'Unseen surfacesCSV']);
  await page.keyboard.press('Escape');
  await page.getByRole('button', { name: 'Clouds' }).click();
  await expect
    .poll(() => page.locator('[data-testid=cloud][data-state=shown]').textContent())
    .toContain('1 beam in 2 drawn');
  const clouds = join(copy, 'plan/viewer/clouds');
  for (const name of readdirSync(clouds)) expect(statSync(join(clouds, name)).size).toBeLessThan(3e6);
  expect(readdirSync(join(copy, 'plan')).sort()).toEqual(['plan.json', 'report', 'stations.csv', 'viewer']);
  await page.goto(`${server.address}clients/house/#view=field`);
  await page.reload();
  await page.locator('.field-view').waitFor();
  await viewer.screenshot('static-field');
});

test('a newer export at the same address is offered, and shown when it is chosen', async () => {
  const viewer = await openCopy();
  await viewer.open();
  await isKept(viewer);
  const changed = join(root, 'changed');
  cpSync(planFolder, changed, { recursive: true });
  const file = join(changed, 'plan.json');
  writeFileSync(file, readFileSync(file, 'utf8').replace('"file": "house.ifc"', '"file": "house, revised.ifc"'));
  exportTo(copy, changed);
  await viewer.open();
  expect(await viewer.page.title()).toContain('house.ifc');
  await viewer.page.getByRole('button', { name: 'Show it' }).click();
  await viewer.page.waitForFunction(() => document.title.includes('revised'));
});

test('a copy opened as a file explains how to open it, and a German browser has it in German', async () => {
  const file = await openPage({}, `file://${copy}/index.html`);
  await file.page.goto(`file://${copy}/index.html`);
  await expect.poll(() => file.page.getByRole('status').textContent()).toContain('python3 -m http.server');
  // A browser refuses scripts of a file.
  file.faults.splice(0);
  const german = await openCopy('de-DE');
  await german.open();
  await expect
    .poll(() => german.page.getByRole('tab').allTextContents())
    .toEqual(['Plan', 'Lücken', 'Netz', 'Prüfung']);
  await german.page.getByText('Der Plan ist jetzt auf diesem Gerät').waitFor();
});

test('an upload that is not complete is shown, and not kept', async () => {
  writeFileSync(join(copy, 'plan/stations.csv'), 'of another export');
  const viewer = await openCopy();
  await viewer.open();
  await viewer.page.locator('html[data-offline=failed]').waitFor({ state: 'attached' });
  await server.stop();
  await expect(viewer.open()).rejects.toThrow('ERR_CONNECTION_REFUSED');
  viewer.faults.splice(0);
});
