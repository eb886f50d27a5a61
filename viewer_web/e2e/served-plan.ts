/** Set-up of the browser tests: one Chromium, and a real plan, served by the real server in a process of its own. */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { TestProject } from 'vitest/node';
import { launchBrowserServer } from './chromium.ts';
import { LACKS_CHROMIUM } from './installed.ts';
import { sceneOf, serveCopy, servePlan } from './plan-server.ts';

declare module 'vitest' {
  export interface ProvidedContext {
    /** Where tests connect to Chromium. */
    browser: string;
    address: string;
    /** The address for comments and verdicts only. */
    commentAddress: string;
    planFolder: string;
    /** The scene file of the plan. */
    scene: string;
  }
}

/** `TLSPLAN_E2E_PLAN` names a plan folder of which a copy is shown, instead of planning. */
export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-'));
  const given = process.env.TLSPLAN_E2E_PLAN;
  const server = await (given === undefined ? servePlan(join(own, 'plan')) : serveCopy(given));
  const browser = LACKS_CHROMIUM === '' ? await launchBrowserServer() : null;
  project.provide('browser', browser?.wsEndpoint() ?? '');
  project.provide('address', server.address);
  project.provide('commentAddress', server.commentAddress);
  project.provide('planFolder', server.folder);
  project.provide('scene', sceneOf(given ?? server.folder));
  return async () => {
    await browser?.close();
    await server.stop();
    rmSync(own, { recursive: true, force: true });
  };
}
