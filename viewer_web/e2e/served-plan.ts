/** Set-up of the browser tests: a real plan, served by the real server in a process of its own. */
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { TestProject } from 'vitest/node';
import { servePlan } from './plan-server.ts';

declare module 'vitest' {
  export interface ProvidedContext {
    address: string;
    planFolder: string;
  }
}

/** `TLSPLAN_E2E_PLAN` names a plan folder to show instead of planning. */
export default async function setup(project: TestProject): Promise<() => Promise<void>> {
  const own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-'));
  const server = await servePlan(process.env.TLSPLAN_E2E_PLAN ?? join(own, 'plan'));
  project.provide('address', server.address);
  project.provide('planFolder', server.folder);
  return async () => {
    await server.stop();
    rmSync(own, { recursive: true, force: true });
  };
}
