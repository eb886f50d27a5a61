/** Chromium as it is installed: one process for the browser tests, or one for a test that measures its memory. */
import { type Browser, type BrowserServer, chromium } from 'playwright-core';
import { CHROMIUM } from './installed.ts';

/** WebGL in software, and no requests of the browser's own. */
const FLAGS = [
  '--no-sandbox',
  '--disable-gpu',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--ignore-gpu-blocklist',
];
/** Software draws pictures slowly, and a click waits for them. */
export const PATIENCE_MS = 240_000;
const OPTIONS = { executablePath: CHROMIUM, args: FLAGS, timeout: PATIENCE_MS };

export function launchBrowser(): Promise<Browser> {
  return chromium.launch(OPTIONS);
}

/** The process that the tests of all files connect to. */
export function launchBrowserServer(): Promise<BrowserServer> {
  return chromium.launchServer(OPTIONS);
}
