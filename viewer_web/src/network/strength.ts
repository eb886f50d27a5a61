/** Colours and words for how firmly a link's shared surface holds two scans together, 0 ... 1. */

import { rgbOf } from '../heat/colors.ts';
import { decimal, t } from '../language/language.ts';

/** Ends of the colours: at the one a scan slides, above the other more makes no difference. */
const WEAK = 0.005;
const STRONG = 0.2;

export const STRENGTH_ENDS = [WEAK, STRONG] as const;

const RAMP = {
  light: ['#b3262e', '#d9822b', '#8a9a3c', '#1f8a6d', '#0f5f8a'],
  dark: ['#ff7b72', '#f2a65a', '#c3cf6b', '#57c7a6', '#62b5ec'],
} as const;
const NOT_COMPUTED = { light: '#8a969d', dark: '#7d8990' } as const;

/** 0 weak ... 1 strong; equal factors are equal steps. */
export function strengthShare(strength: number): number {
  const share = Math.log(Math.max(strength, WEAK) / WEAK) / Math.log(STRONG / WEAK);
  return Math.min(1, share);
}

export function strengthColor(strength: number | null, isDark: boolean): string {
  const theme = isDark ? 'dark' : 'light';
  if (strength === null) return NOT_COMPUTED[theme];
  const ramp = RAMP[theme];
  const at = strengthShare(strength) * (ramp.length - 1);
  const low = Math.min(ramp.length - 2, Math.floor(at));
  const [a, b] = [rgbOf(ramp[low]), rgbOf(ramp[low + 1])];
  const mixed = a.map((x, k) => Math.round(x + (at - low) * (b[k] - x)));
  return `#${mixed.map((x) => x.toString(16).padStart(2, '0')).join('')}`;
}

export function strengthInWords(strength: number | null): string {
  if (strength === null) return t('not computed');
  const share = strengthShare(strength);
  const word = share < 0.3 ? t('weak') : share < 0.65 ? t('fair') : t('strong');
  return `${decimal(strength, 3)} (${word})`;
}

const OVERLAP = { light: ['#e4efee', '#17607a'], dark: ['#24333a', '#7fd0da'] } as const;

/** 0 pale ... 1 deep, by the square root: most overlaps are small. */
export function overlapColor(overlap: number, isDark: boolean): string {
  const [a, b] = OVERLAP[isDark ? 'dark' : 'light'].map(rgbOf);
  const share = Math.sqrt(Math.min(1, Math.max(0, overlap)));
  return `rgb(${a.map((x, k) => Math.round(x + share * (b[k] - x))).join(' ')})`;
}
