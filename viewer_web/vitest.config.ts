import { defineConfig } from 'vitest/config';

export default defineConfig({
  // No test is about time, and a machine may be busy: one of them generates the types of the server's documents anew.
  test: {
    include: ['src/**/*.test.ts'],
    environment: 'node',
    // The tests share nothing but modules: a worker for each of a hundred files would load them all anew.
    isolate: false,
    maxWorkers: 1,
    testTimeout: 300_000,
    hookTimeout: 300_000,
    expect: { poll: { timeout: 30_000 } },
  },
});
