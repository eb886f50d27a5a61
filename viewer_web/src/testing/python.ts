/** Runs the project's Python in tests, where it is the writer or the reference of what the browser reads. */
import { execFileSync } from 'node:child_process';
import { fileURLToPath } from 'node:url';

const REPOSITORY = fileURLToPath(new URL('../../../', import.meta.url));

/** Standard output of the project's interpreter: `TLSPLAN_PYTHON`, else the one `make` sets up. */
export function runPython(...args: string[]): string {
  const python = process.env.TLSPLAN_PYTHON ?? `${REPOSITORY}.venv/bin/python`;
  return execFileSync(python, args, { cwd: REPOSITORY, encoding: 'utf8', maxBuffer: 1 << 28 });
}
