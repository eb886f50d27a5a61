import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expect, test } from 'vitest';

test('every style has its place in the order, those of narrow windows and paper at its end', () => {
  const folder = import.meta.dirname;
  const files = readdirSync(folder, { recursive: true, encoding: 'utf8' }).filter((file) => file.endsWith('.css'));
  const text = readFileSync(join(folder, 'styles.ts'), 'utf8');
  const listed = [...text.matchAll(/^import '\.\/(.*\.css)';$/gm)].map(([, file]) => file);
  expect([...listed].sort()).toEqual([...files].sort());
  expect(listed.slice(-2)).toEqual(['style.css', 'panels/print.css']);
});
