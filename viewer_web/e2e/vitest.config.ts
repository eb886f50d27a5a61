import { appendFileSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { defineConfig } from 'vitest/config';
import { LACKS_CHROMIUM, LACKS_FIREFOX } from './installed.ts';

const HERE = import.meta.dirname;
/** Files of a run by its mode; the mode `rest` has all others. */
const FILES: Record<string, readonly string[]> = {
  main: ['journeys.e2e.ts'],
  firefox: ['firefox-more.e2e.ts'],
  scenes: ['scenes.e2e.ts', 'memory.e2e.ts'],
};

function filesOf(mode: string): string[] {
  const listed = Object.values(FILES).flat();
  const all = readdirSync(HERE).filter((file) => file.endsWith('.e2e.ts'));
  return all.filter((file) => (mode === 'rest' ? !listed.includes(file) : FILES[mode].includes(file)));
}

const lackOf = (file: string): string => (file.startsWith('firefox') ? LACKS_FIREFOX : LACKS_CHROMIUM);

/** One line with the number of tests in each file that can't run. */
function skippedWords(files: readonly string[]): string {
  const counts = files.map((file) => readFileSync(join(HERE, file), 'utf8').match(/^test[.(]/gm)?.length ?? 0);
  const names = files.map((file, i) => `${counts[i]} of ${file}`);
  const total = counts.reduce((a, b) => a + b, 0);
  return `browser tests: ${total} skipped, ${names.join(', ')}: ${[...new Set(files.map(lackOf))].join('; ')}\n`;
}

export default defineConfig(({ mode }) => {
  const files = filesOf(mode);
  const skipped = files.filter((file) => lackOf(file) !== '');
  const isLong = mode === 'scenes';
  if (skipped.length > 0) {
    const words = skippedWords(skipped);
    process.stdout.write(words);
    // make prints this file last.
    if (process.env.SKIPPED_TESTS) appendFileSync(process.env.SKIPPED_TESTS, words);
  }
  return {
    test: {
      root: HERE,
      include: files.filter((file) => !skipped.includes(file)),
      passWithNoTests: skipped.length > 0,
      globalSetup: isLong || skipped.length === files.length ? [] : ['./served-plan.ts'],
      // Software rendering, cold caches and a busy machine: no test here is about time. What waits for the page ends first,
      // and reports what it waited for. A run of a whole scene that takes longer is stuck.
      testTimeout: isLong ? 5_400_000 : 600_000,
      hookTimeout: 600_000,
      expect: { poll: { timeout: 240_000 } },
      fileParallelism: false,
    },
  };
});
