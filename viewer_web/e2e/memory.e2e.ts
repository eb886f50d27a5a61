/**
 * Memory of the browser with the clouds of 60 stations of a scanner of 46 million beams: `make e2e-scenes`.
 *
 * `TLSPLAN_E2E_SIXTY` names the plan folder; without it the plan is made, in minutes. What was measured is in
 * test-results/clouds-memory.json.
 */
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import type { CDPSession } from 'playwright-core';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { ViewerPage } from './browser.ts';
import { launchBrowser } from './chromium.ts';
import { countGl, glCount } from './gl-meter.ts';
import { type PlanServer, PYTHON, REPOSITORY, servePlan } from './plan-server.ts';

const RESULTS = fileURLToPath(new URL('../test-results/', import.meta.url));
const MOST_BYTES = 500e6;

let own: string;
let server: PlanServer;
beforeAll(async () => {
  own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-sixty-'));
  const folder = process.env.TLSPLAN_E2E_SIXTY ?? join(own, 'plan');
  if (process.env.TLSPLAN_E2E_SIXTY === undefined) {
    execFileSync(PYTHON, ['viewer_web/e2e/plan_sixty.py', folder], { cwd: REPOSITORY, stdio: 'inherit' });
  }
  server = await servePlan(folder);
}, 3_600_000);
afterAll(async () => {
  await server.stop();
  rmSync(own, { recursive: true, force: true });
});

/** Of the page: objects of scripts, and array buffers, which lie beside them. */
async function heap(session: CDPSession): Promise<{ objects: number; buffers: number }> {
  await session.send('HeapProfiler.collectGarbage');
  const found = (await session.send('Runtime.getHeapUsage')) as { usedSize: number; backingStorageSize?: number };
  expect(found.backingStorageSize, 'a Chromium that tells what array buffers take').toBeGreaterThan(0);
  return { objects: found.usedSize, buffers: found.backingStorageSize! };
}

test('sixty clouds at once, each told by what share is drawn, take less than 500 MB', async () => {
  const browser = await launchBrowser();
  const viewer = await ViewerPage.create(browser, server.address, { width: 1000, height: 640 });
  await countGl(viewer.page);
  await viewer.open();
  const session = await viewer.page.context().newCDPSession(viewer.page);
  const without = { ...(await heap(session)), graphics: (await glCount(viewer.page)).bytes };
  await viewer.page.getByRole('button', { name: 'Clouds' }).click();
  const shown = viewer.page.locator('[data-testid=cloud][data-state=shown]');
  // Drawn in software, every picture on the way takes seconds.
  await shown.waitFor({ timeout: 1_800_000 });
  await viewer.settle();
  const words = await shown.locator('p').first().textContent();
  expect(words).toMatch(/from 60 stations: 1 beam in \d+ drawn/);
  await viewer.screenshot('clouds-sixty');
  const clouds = { ...(await heap(session)), graphics: (await glCount(viewer.page)).bytes };
  mkdirSync(RESULTS, { recursive: true });
  writeFileSync(`${RESULTS}clouds-memory.json`, `${JSON.stringify({ words, without, clouds }, null, 1)}\n`);
  expect(clouds.objects + clouds.buffers + clouds.graphics).toBeLessThan(MOST_BYTES);
  expect(viewer.faults).toEqual([]);
  await browser.close();
});
