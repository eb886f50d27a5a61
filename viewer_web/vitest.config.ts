import { defineConfig } from 'vitest/config';

export default defineConfig({
  // No test is about time, and a machine may be busy: one of them generates the types of the server's documents anew.
  test: {
    include: ['src/**/*.test.ts'],
    environment: 'node',
    testTimeout: 300_000,
    hookTimeout: 300_000,
    expect: { poll: { timeout: 30_000 } },
  },
});
