/** Set-up of the browser tests: a real plan, served by the real server in a process of its own. */
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import type { TestProject } from 'vitest/node';

declare module 'vitest' {
  export interface ProvidedContext {
    address: string;
    planFolder: string;
  }
}

const REPOSITORY = fileURLToPath(new URL('../../', import.meta.url));

/** `TLSPLAN_E2E_PLAN` names a plan folder to show instead of planning; `TLSPLAN_PYTHON` the interpreter. */
export default async function setup(project: TestProject): Promise<() => void> {
  const own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-'));
  const folder = process.env.TLSPLAN_E2E_PLAN ?? join(own, 'plan');
  const python = process.env.TLSPLAN_PYTHON ?? `${REPOSITORY}.venv/bin/python`;
  const server = spawn(python, ['viewer_web/e2e/serve_plan.py', folder], {
    cwd: REPOSITORY,
    stdio: ['ignore', 'pipe', 'inherit'],
  });
  const address = await new Promise<string>((resolve, reject) => {
    let said = '';
    server.stdout.on('data', (chunk: Buffer) => {
      said += chunk.toString();
      if (said.split('\n').length > 2) resolve(said.split('\n')[0]);
    });
    server.on('exit', (code) => reject(new Error(`serve_plan.py ended with ${code} before it served`)));
    server.on('error', reject);
  });
  project.provide('address', address);
  project.provide('planFolder', folder);
  return () => {
    server.removeAllListeners('exit');
    server.kill('SIGTERM');
    rmSync(own, { recursive: true, force: true });
  };
}
