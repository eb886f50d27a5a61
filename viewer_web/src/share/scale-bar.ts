/** A bar of a round length, for a picture of the scene. */
import { lengthWords } from '../panels/figures.ts';
import { FOOT_M, units } from '../panels/units.ts';

export interface ScaleBar {
  readonly lengthPx: number;
  readonly words: string;
}

/** The longest of 1, 2 or 5 times a power of ten, metres or feet, that is no longer than `mostPx`. */
export function scaleBar(metresPerPixel: number, mostPx: number): ScaleBar {
  const unitM = units.value === 'ft' ? FOOT_M : 1;
  const most = (mostPx * metresPerPixel) / unitM;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((times) => times * power).find((each) => each <= most * (1 + 1e-9)) ?? power;
  const digits = Math.max(0, -Math.floor(Math.log10(length) + 1e-9));
  return { lengthPx: (length * unitM) / metresPerPixel, words: lengthWords(length * unitM, digits) };
}
