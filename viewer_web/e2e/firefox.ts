/** Firefox as it is installed, on a screen in memory: without a screen it has no WebGL in software. */
import { type ChildProcess, spawn } from 'node:child_process';
import { existsSync } from 'node:fs';
import type { Readable } from 'node:stream';
import puppeteer, { type Browser } from 'puppeteer-core';

const PLACES = ['/usr/bin/firefox-esr', '/usr/bin/firefox'];
const SCREENS = '/usr/bin/Xvfb';
const PATIENCE_MS = 240_000;

const firefox = process.env.TLSPLAN_FIREFOX ?? PLACES.find((place) => existsSync(place));

/** What Firefox can't be started for, empty where it can. */
export const LACKS_FIREFOX =
  firefox === undefined ? `no Firefox at ${PLACES.join(', ')}` : existsSync(SCREENS) ? '' : `no ${SCREENS}`;

export interface Firefox {
  readonly browser: Browser;
  close(): Promise<void>;
}

export async function launchFirefox(): Promise<Firefox> {
  if (firefox === undefined) throw new Error(LACKS_FIREFOX);
  const { screen, display } = await openScreen();
  try {
    const browser = await puppeteer.launch({
      browser: 'firefox',
      executablePath: firefox,
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
  const screen = spawn(SCREENS, ['-displayfd', '3', '-screen', '0', '1280x1024x24', '-nolisten', 'tcp'], {
    stdio: ['ignore', 'ignore', 'inherit', 'pipe'],
  });
  const number = await new Promise<string>((found, reject) => {
    (screen.stdio[3] as Readable).once('data', (said: Buffer) => found(said.toString().trim()));
    screen.once('error', reject);
    screen.once('exit', (code) => reject(new Error(`Xvfb ended with ${code}`)));
  });
  return { screen, display: `:${number}` };
}
