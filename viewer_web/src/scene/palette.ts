/**
 * Colours of the 3D view, light and dark; those of the layers: heat/layers.ts. Unseen is orange: against the blue-greens of
 * what is seen it stays apart for all common kinds of colour blindness, and differs in lightness too.
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
  readonly notAsked: string;
  readonly picked: string;
  /** Patches that are highlighted. */
  readonly mark: string;
  /** What a moved station would no longer cover, and what it would besides; red is darker, for those who tell them by that. */
  readonly lost: string;
  readonly won: string;
  readonly link: string;
  readonly isDark: boolean;
}

const COVERAGE = {
  unseen: '#e8833a',
  picked: '#f5c211',
  mark: '#a04fc9',
  lost: '#b3162b',
  won: '#63d471',
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
  notAsked: '#eef0f1',
  link: '#7a3fa0',
  isDark: false,
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
  notAsked: '#42494e',
  link: '#c79be6',
  isDark: true,
};
