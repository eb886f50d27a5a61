import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { expect, test } from 'vitest';
import { generated } from '../../make-api-types.mjs';

const ROOT = new URL('../../', import.meta.url);

test.each(Object.entries(await generated()))('%s is made of the models (npm run types makes it)', (path, text) => {
  const biome = ['biome', 'format', `--stdin-file-path=${path}`];
  const made = execFileSync('npx', biome, { cwd: fileURLToPath(ROOT), encoding: 'utf8', input: text, stdio: 'pipe' });
  expect(made).toBe(readFileSync(new URL(path, ROOT), 'utf8'));
});
