import { defineConfig } from 'vitest/config';

export default defineConfig({
  test: {
    root: import.meta.dirname,
    include: ['*.e2e.ts'],
    exclude: ['scenes.e2e.ts'],
    globalSetup: ['./served-plan.ts'],
    // Software rendering on a busy machine: no test here is about time.
    testTimeout: 90_000,
    hookTimeout: 90_000,
    fileParallelism: false,
  },
});
