import { defineConfig } from 'vitest/config';

export default defineConfig({
  test: {
    root: import.meta.dirname,
    reporters: ['default', './skipped-tests.ts'],
    include: ['*.e2e.ts'],
    exclude: ['scenes.e2e.ts', 'memory.e2e.ts'],
    globalSetup: ['./served-plan.ts'],
    tags: [{ name: 'main', description: 'what everybody does: `make test` has these, `make test-slow` all' }],
    // Software rendering, cold caches and a busy machine: no test here is about time. What waits for the page ends first,
    // and says what it waited for.
    testTimeout: 600_000,
    hookTimeout: 600_000,
    expect: { poll: { timeout: 240_000 } },
    fileParallelism: false,
  },
});
