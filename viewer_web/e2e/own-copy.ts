/** A browser, and a server on a copy of the plan that the tests of one file may change. */
import type { Browser } from 'playwright-core';
import { afterAll, beforeAll } from 'vitest';
import { launchBrowser } from './browser.ts';
import { type PlanServer, serveCopy } from './plan-server.ts';

/** Both are there in the file's tests, and gone after the last of them. */
export function ownCopy(planFolder: string): { browser: Browser; server: PlanServer } {
  const own = {} as { browser: Browser; server: PlanServer };
  beforeAll(async () => {
    own.browser = await launchBrowser();
    own.server = await serveCopy(planFolder);
  });
  afterAll(async () => {
    await own.browser.close();
    await own.server.stop();
  });
  return own;
}
