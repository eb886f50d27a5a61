/** The browser tests on real scenes: `make e2e-scenes`. */
import { defineConfig } from 'vitest/config';

export default defineConfig({
  test: {
    root: import.meta.dirname,
    include: ['scenes.e2e.ts', 'memory.e2e.ts'],
    // Large plans, drawn in software, on a machine that may be busy: no test here is about time. What a page does not answer
    // ends earlier, a run that goes on for longer is stuck.
    testTimeout: 5_400_000,
    hookTimeout: 300_000,
    expect: { poll: { timeout: 240_000 } },
  },
});
