import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { expect, test } from 'vitest';
import { apiTypes } from '../../make-api-types.mjs';

test('the types are those of the interface (npm run types makes them)', async () => {
  const kept = readFileSync(new URL('schema.ts', import.meta.url), 'utf8');
  const root = fileURLToPath(new URL('../..', import.meta.url));
  const biome = ['biome', 'format', '--stdin-file-path=src/api/schema.ts'];
  const made = execFileSync('npx', biome, { cwd: root, encoding: 'utf8', input: await apiTypes(), stdio: 'pipe' });
  expect(made).toBe(kept);
});
