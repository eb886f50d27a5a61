/** The browsers of this machine, and why tests in one of them can't run. */
import { existsSync } from 'node:fs';

const CHROMIUMS = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome', '/snap/bin/chromium'];
const FIREFOXES = ['/usr/bin/firefox-esr', '/usr/bin/firefox'];
/** A screen in memory: without one Firefox has no WebGL in software. */
export const XVFB = '/usr/bin/Xvfb';

const found = (paths: readonly string[]): string => paths.find((path) => existsSync(path)) ?? '';

export const CHROMIUM = process.env.TLSPLAN_CHROMIUM ?? found(CHROMIUMS);
export const FIREFOX = process.env.TLSPLAN_FIREFOX ?? found(FIREFOXES);

/** Empty where Chromium can be started. */
export const LACKS_CHROMIUM = existsSync(CHROMIUM)
  ? ''
  : `no Chromium at ${CHROMIUM || CHROMIUMS.join(', ')}; set TLSPLAN_CHROMIUM`;

/** Empty where Firefox can be started. */
export const LACKS_FIREFOX = existsSync(FIREFOX)
  ? found([XVFB]) === ''
    ? `no ${XVFB}`
    : ''
  : `no Firefox at ${FIREFOX || FIREFOXES.join(', ')}; set TLSPLAN_FIREFOX`;
