/** Round steps for the grid and the scale bar, in the chosen unit. */
import { plain } from '../language/language.ts';
import { FOOT_M, type Units } from '../panels/units.ts';

/** 1, 2 or 5 times a power of ten of the unit: the least that is so many metres or more. */
export function roundStepM(leastM: number, unit: Units): number {
  const unitM = unit === 'm' ? 1 : FOOT_M;
  const power = 10 ** Math.floor(Math.log10(leastM / unitM));
  const step = [1, 2, 5, 10].find((one) => one * power * unitM >= leastM * (1 - 1e-9)) ?? 10;
  return step * power * unitM;
}

/** Multiples of a step from `low` to `high`. */
export function multiples(stepM: number, low: number, high: number): number[] {
  const first = Math.ceil(low / stepM - 1e-9);
  const n = Math.floor(high / stepM + 1e-9) - first + 1;
  return Array.from({ length: Math.max(0, n) }, (_, i) => (first + i) * stepM);
}

/** "5 m", "0.5 m", "20 ft": round, so with no more decimals than it needs. */
export function stepWords(stepM: number, unit: Units): string {
  return `${plain(Number((unit === 'm' ? stepM : stepM / FOOT_M).toFixed(6)))} ${unit}`;
}
