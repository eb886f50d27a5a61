/** Appends the skipped tests to the file SKIPPED_TESTS, a line per reason and file; make prints it last. */
import { appendFileSync } from 'node:fs';
import type { Reporter, TestModule, Vitest } from 'vitest/node';

export default class SkippedTests implements Reporter {
  #tags: readonly string[] = [];

  onInit(vitest: Vitest): void {
    this.#tags = vitest.config.tagsFilter ?? [];
  }

  onTestRunEnd(modules: readonly TestModule[]): void {
    const counts = new Map<string, number>();
    for (const module of modules) {
      for (const test of module.children.allTests('skipped')) {
        const result = test.result();
        const note = result.state === 'skipped' ? result.note : undefined;
        const reason = `${note ?? 'the browser is missing'} (viewer_web/e2e/${module.relativeModuleId})`;
        // A filter of tags leaves tests out on purpose.
        if (this.#tags.every((tag) => test.tags.includes(tag))) counts.set(reason, (counts.get(reason) ?? 0) + 1);
      }
    }
    const path = process.env.SKIPPED_TESTS;
    if (path) appendFileSync(path, [...counts].map(([reason, n]) => `${n} skipped: ${reason}\n`).join(''));
  }
}
