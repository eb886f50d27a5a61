/** The real server, in a process of its own, on a plan folder or on a copy of one that a test may change. */
import { spawn } from 'node:child_process';
import { cpSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

export const REPOSITORY = fileURLToPath(new URL('../../', import.meta.url));
export const PYTHON = process.env.TLSPLAN_PYTHON ?? `${REPOSITORY}.venv/bin/python`;

export interface PlanServer {
  readonly address: string;
  /** Of those who may comment and give verdicts, and no more. */
  readonly commentAddress: string;
  readonly folder: string;
  /** Ends it; `SIGKILL` as a machine that loses power would. */
  stop(signal?: NodeJS.Signals): Promise<void>;
}

/**
 * Serve a plan folder, planning it first where there is none; `TLSPLAN_PYTHON` names the interpreter. `keepIn`: a cache
 * folder that keeps its links; empty: they are not kept.
 */
export async function servePlan(folder: string, scene = '', port = 0, keepIn = ''): Promise<PlanServer> {
  const args = ['-m', 'viewer_web.e2e.serve_plan', folder, scene, `${port}`, ...(keepIn ? ['keep'] : [])];
  const env = keepIn ? { ...process.env, TLSPLAN_CACHE: keepIn } : process.env;
  const server = spawn(PYTHON, args, { cwd: REPOSITORY, env, stdio: ['ignore', 'pipe', 'inherit'] });
  const ended = new Promise<void>((done) => server.on('exit', () => done()));
  const [address, , commentAddress] = await new Promise<string[]>((resolveLines, reject) => {
    let output = '';
    server.stdout.on('data', (chunk: Buffer) => {
      output += chunk.toString();
      if (output.split('\n').length > 3) resolveLines(output.split('\n'));
    });
    server.on('exit', (code) => reject(new Error(`serve_plan.py ended with ${code} before it served`)));
    server.on('error', reject);
  });
  return {
    address,
    commentAddress,
    folder,
    stop: (signal = 'SIGTERM') => {
      server.kill(signal);
      return ended;
    },
  };
}

/** Serve a copy of a plan folder: what tests change there, others do not see. */
export async function serveCopy(planFolder: string, scene = sceneOf(planFolder)): Promise<PlanServer> {
  const own = mkdtempSync(join(tmpdir(), 'tlsplan-e2e-copy-'));
  const folder = join(own, 'plan');
  cpSync(planFolder, folder, { recursive: true });
  const server = await servePlan(folder, scene);
  return {
    ...server,
    stop: async (signal) => {
      await server.stop(signal);
      if (signal !== 'SIGKILL') rmSync(own, { recursive: true, force: true });
    },
  };
}

/** Where the plan says that its scene is. */
export function sceneOf(planFolder: string): string {
  const { source } = JSON.parse(readFileSync(join(planFolder, 'plan.json'), 'utf8')) as { source: { path: string } };
  return resolve(planFolder, source.path);
}

/** Serve a folder by `python -m http.server`, as the how-to page has it; its first line has the port. */
export async function serveStatic(root: string): Promise<{ address: string; stop: () => Promise<void> }> {
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
    address: `http://127.0.0.1:${port}/`,
    stop: () => {
      server.kill();
      return ended;
    },
  };
}
