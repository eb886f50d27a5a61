/** The exported plan, from a plain web server below a folder, and then without any server. */
import { execFileSync, spawn } from 'node:child_process';
import { cpSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import type { Browser } from 'playwright-core';
import { afterAll, afterEach, beforeAll, beforeEach, expect, inject, test } from 'vitest';
import { launchBrowser, ViewerPage } from './browser.ts';

const REPOSITORY = fileURLToPath(new URL('../../', import.meta.url));
const PYTHON = process.env.TLSPLAN_PYTHON ?? `${REPOSITORY}.venv/bin/python`;
const planFolder = inject('planFolder');

/** `python -m http.server`, as the how-to page says; it announces its port on its first line. */
async function serveStatic(root: string): Promise<{ address: string; stop: () => Promise<void> }> {
  const server = spawn(PYTHON, ['-u', '-m', 'http.server', '0', '--bind', '127.0.0.1'], {
    cwd: root,
    stdio: ['ignore', 'pipe', 'ignore'],
  });
  const ended = new Promise<void>((done) => server.on('exit', () => done()));
  const port = await new Promise<string>((found, reject) => {
    server.stdout.on('data', (chunk: Buffer) => {
      const port = / port (\d+)/.exec(chunk.toString());
      if (port) found(port[1]);
    });
    server.on('exit', (code) => reject(new Error(`http.server ended with ${code}`)));
  });
  return {
    address: `http://127.0.0.1:${port}/clients/house/`,
    stop: () => {
      server.kill();
      return ended;
    },
  };
}

function exportTo(folder: string, plan = planFolder): void {
  const command = ['-m', 'tlsplan', 'export', plan, '--format', 'web', '-o', folder, '--overwrite', '--quiet'];
  execFileSync(PYTHON, command, { cwd: REPOSITORY, stdio: ['ignore', 'ignore', 'inherit'] });
}

let browser: Browser;
let root: string;
let server: Awaited<ReturnType<typeof serveStatic>>;
let viewer: ViewerPage;

beforeAll(async () => {
  browser = await launchBrowser();
  root = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-static-'));
});
afterAll(async () => {
  await browser.close();
  rmSync(root, { recursive: true, force: true });
});
beforeEach(async () => {
  exportTo(join(root, 'clients/house'));
  server = await serveStatic(root);
  viewer = await ViewerPage.create(browser, server.address, { width: 1180, height: 820 });
});
afterEach(async () => {
  await viewer.page.close();
  await server.stop();
});

const isKept = (): Promise<void> => viewer.page.locator('html[data-offline=ready]').waitFor({ state: 'attached' });

test('the export opens below a folder of a static host, without a request to a server of ours', {
  tags: 'main',
}, async () => {
  const asked: string[] = [];
  viewer.page.on('request', (request) => asked.push(new URL(request.url()).pathname));
  await viewer.open();
  await isKept();
  expect(viewer.faults).toEqual([]);
  expect(asked.filter((path) => !path.startsWith('/clients/house/'))).toEqual([]);
  expect(asked.filter((path) => path.includes('/api/'))).toEqual([]);
  await viewer.screenshot('static-plan');
});

test('the export opens without network once it was opened, clouds and the field view too', async () => {
  await viewer.open();
  await isKept();
  await server.stop();
  await viewer.open();
  const plan = JSON.parse(readFileSync(join(planFolder, 'plan.json'), 'utf8')) as { stations: { id: string }[] };
  const sizes = await viewer.page.evaluate(
    async (ids) =>
      Promise.all(ids.map(async (id) => (await (await fetch(`plan/viewer/clouds/${id}.u16`)).blob()).size)),
    plan.stations.map(({ id }) => id),
  );
  expect(sizes.every((size) => size > 0)).toBe(true);
  await viewer.page.goto(`${server.address}#view=field`);
  await viewer.page.reload();
  await viewer.page.locator('.field-view').waitFor();
  await viewer.screenshot('static-field');
  expect(viewer.faults).toEqual([]);
});

test('what the copy holds can be downloaded, without network too, and its clouds are previews that say so', async () => {
  await viewer.open();
  await isKept();
  await server.stop();
  await viewer.open('#floor=F0');
  const { page } = viewer;
  await page.getByRole('button', { name: 'Share' }).click();
  const menu = page.getByRole('region', { name: 'Share and download' });
  const [download] = await Promise.all([
    page.waitForEvent('download'),
    menu.getByRole('link', { name: /Station list/ }).click(),
  ]);
  expect(download.suggestedFilename()).toBe('stations.csv');
  expect(await menu.getByRole('link').allTextContents()).toEqual([
    'Station listCSV',
    'Reportopens',
    'Unseen elementsCSV',
    'Unseen surfacesCSV',
  ]);
  await viewer.screenshot('static-share');
  await page.keyboard.press('Escape');
  await page.getByRole('button', { name: 'Clouds' }).click();
  await expect
    .poll(() => page.locator('[data-testid=cloud][data-state=shown]').textContent())
    .toContain('1 beam in 2 drawn');
  const clouds = join(root, 'clients/house/plan/viewer/clouds');
  for (const name of readdirSync(clouds)) expect(statSync(join(clouds, name)).size).toBeLessThan(3e6);
  expect(readdirSync(join(root, 'clients/house/plan')).sort()).toEqual([
    'plan.json',
    'report',
    'stations.csv',
    'viewer',
  ]);
  expect(viewer.faults).toEqual([]);
});

test('a newer export of the same address is offered, and shown where somebody takes it', async () => {
  await viewer.open();
  await isKept();
  const changed = join(root, 'changed');
  cpSync(planFolder, changed, { recursive: true });
  const file = join(changed, 'plan.json');
  writeFileSync(file, readFileSync(file, 'utf8').replace('"file": "house.ifc"', '"file": "house, revised.ifc"'));
  exportTo(join(root, 'clients/house'), changed);
  await viewer.open();
  expect(await viewer.page.title()).toContain('house.ifc');
  await viewer.page.getByRole('button', { name: 'Show it' }).click();
  await viewer.page.waitForFunction(() => document.title.includes('revised'));
  expect(viewer.faults).toEqual([]);
});

test('an upload that still goes on is shown, and not kept', async () => {
  writeFileSync(join(root, 'clients/house/plan/stations.csv'), 'of another export');
  await viewer.open();
  await viewer.page.locator('html[data-offline=failed]').waitFor({ state: 'attached' });
  await server.stop();
  await expect(viewer.open()).rejects.toThrow('ERR_CONNECTION_REFUSED');
});

test('what is opened as a file says how it is opened', async () => {
  await viewer.page.goto(`file://${join(root, 'clients/house/index.html')}`);
  await viewer.page.getByRole('status').waitFor();
  expect(await viewer.page.getByRole('status').textContent()).toContain('python3 -m http.server');
});

test('a German browser has the copy in German, and what it says of being kept', async () => {
  await viewer.page.close();
  viewer = await ViewerPage.create(browser, server.address, { width: 1180, height: 820, locale: 'de-DE' });
  await viewer.open();
  expect(await viewer.page.getByRole('tab').allTextContents()).toEqual(['Plan', 'Lücken', 'Netz', 'Prüfung']);
  await viewer.page.getByText('Der Plan ist jetzt auf diesem Gerät').waitFor();
  expect(viewer.faults).toEqual([]);
});
