/** Firefox as it is installed, on a screen in memory: without a screen it has no WebGL in software. */
import { type ChildProcess, spawn } from 'node:child_process';
import type { Readable } from 'node:stream';
import puppeteer, { type Browser, type Page } from 'puppeteer-core';
import { expect } from 'vitest';
import { FIREFOX, XVFB } from './installed.ts';

const PATIENCE_MS = 240_000;

interface Firefox {
  readonly browser: Browser;
  close(): Promise<void>;
}

/** Do something on a page of the viewer in Firefox; the page must have no fault meanwhile. */
export async function onFirefoxPage(address: string, use: (page: Page) => Promise<void>): Promise<void> {
  const { browser, close } = await launchFirefox();
  try {
    const page = await browser.newPage();
    page.setDefaultTimeout(PATIENCE_MS);
    const faults: string[] = [];
    page.on('pageerror', (error) => faults.push(`page error: ${error}`));
    page.on('console', (message) => {
      if (message.type() === 'error') faults.push(`console: ${message.text()}`);
    });
    await page.setViewport({ width: 960, height: 600 });
    await page.goto(address);
    await page.waitForSelector('.marker:not([hidden])');
    await settle(page);
    await use(page);
    expect(faults).toEqual([]);
  } finally {
    await close();
  }
}

/** Wait until the picture has been drawn. */
export function settle(page: Page): Promise<void> {
  return page.evaluate(
    () => new Promise<void>((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))),
  );
}

export async function centreOf(page: Page, id: string): Promise<{ x: number; y: number }> {
  const box = (await (await page.waitForSelector(`.marker[data-station="${id}"]`))!.boundingBox())!;
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

async function launchFirefox(): Promise<Firefox> {
  const { screen, display } = await openScreen();
  try {
    const browser = await puppeteer.launch({
      browser: 'firefox',
      executablePath: FIREFOX,
      headless: false,
      timeout: PATIENCE_MS,
      protocolTimeout: PATIENCE_MS,
      env: { ...process.env, DISPLAY: display, LIBGL_ALWAYS_SOFTWARE: '1' },
      extraPrefsFirefox: { 'webgl.force-enabled': true, 'ui.prefersReducedMotion': 1 },
    });
    return {
      browser,
      close: async () => {
        await browser.close();
        screen.kill();
      },
    };
  } catch (error) {
    screen.kill();
    throw error;
  }
}

/** A screen in memory, under a number that is free. */
async function openScreen(): Promise<{ screen: ChildProcess; display: string }> {
  const screen = spawn(XVFB, ['-displayfd', '3', '-screen', '0', '1280x1024x24', '-nolisten', 'tcp'], {
    stdio: ['ignore', 'ignore', 'inherit', 'pipe'],
  });
  const number = await new Promise<string>((found, reject) => {
    (screen.stdio[3] as Readable).once('data', (line: Buffer) => found(line.toString().trim()));
    screen.once('error', reject);
    screen.once('exit', (code) => reject(new Error(`Xvfb ended with ${code}`)));
  });
  return { screen, display: `:${number}` };
}
