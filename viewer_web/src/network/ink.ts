/** Ink that is read on a colour: black or white, whichever contrasts more (WCAG 2.2, relative luminance). */

export const DARK_INK = '#000000';
export const LIGHT_INK = '#ffffff';

/** `color`: "#b3262e" or "rgb(179 38 46)". */
export function inkOn(color: string): string {
  const luminance = luminanceOf(channelsOf(color));
  return (luminance + 0.05) ** 2 > 0.05 * 1.05 ? DARK_INK : LIGHT_INK;
}

export function channelsOf(color: string): readonly number[] {
  if (!color.startsWith('#')) return (color.match(/\d+/g) ?? []).map(Number);
  return [1, 3, 5].map((from) => Number.parseInt(color.slice(from, from + 2), 16));
}

function luminanceOf([r, g, b]: readonly number[]): number {
  const [lr, lg, lb] = [r, g, b].map((one) => {
    const share = one / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * lr + 0.7152 * lg + 0.0722 * lb;
}
