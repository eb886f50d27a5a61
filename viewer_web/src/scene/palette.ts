/**
 * Colours of the 3D view, light and dark. Seen: one blue-green ramp by number of stations; unseen: orange; not achievable:
 * grey. Blue-green against orange stays apart for all common kinds of colour blindness, and differs in lightness too.
 */

export interface Palette {
  readonly background: string;
  readonly backgroundTop: string;
  readonly plain: string;
  readonly ground: string;
  readonly section: string;
  readonly line: string;
  readonly unseen: string;
  readonly notAchievable: string;
  /** Seen by 1, 2, 3, 4 or more stations. */
  readonly seen: readonly [string, string, string, string];
  readonly picked: string;
  readonly link: string;
}

const COVERAGE = {
  unseen: '#e8833a',
  seen: ['#a9d9d3', '#62b6b7', '#2b8a9b', '#17607a'],
  picked: '#f5c211',
} as const;

export const LIGHT: Palette = {
  ...COVERAGE,
  background: '#e9edf0',
  backgroundTop: '#f8fafb',
  plain: '#dfe2e3',
  ground: '#cfc7b9',
  section: '#3c474e',
  line: '#2a3338',
  notAchievable: '#c6cacc',
  link: '#7a3fa0',
};

export const DARK: Palette = {
  ...COVERAGE,
  background: '#12181c',
  backgroundTop: '#1d262c',
  plain: '#9aa3a8',
  ground: '#8d867b',
  section: '#06090b',
  line: '#05080a',
  notAchievable: '#6d757a',
  link: '#c79be6',
};
