/** A physical quantity as people write it: millimetres or inches where they are meant, no more digits than matter. */
import { decimal, plain } from '../language/language.ts';
import { FOOT_M, units } from '../panels/units.ts';

/** `value` in `unit`; `beside` sets the unit and digits where several stand side by side. */
export function quantity(value: number, unit: string, beside = value): string {
  if (unit === 'deg') return `${decimal(value, 0)}°`;
  if (unit !== 'm') return `${withDigits(value, beside)} ${unit}`;
  if (units.value === 'ft') {
    const [size, name] = Math.abs(beside) < 0.1 ? [FOOT_M / 12, 'in'] : [FOOT_M, 'ft'];
    return `${withDigits(value / size, beside / size)} ${name}`;
  }
  if (Math.abs(beside) < 0.1) return `${withDigits(1000 * value, 1000 * beside)} mm`;
  return `${withDigits(value, beside)} m`;
}

/** As many decimals as give `beside` three figures, at most two: below 10 two, below 100 one; trailing zeros off. */
function withDigits(value: number, beside: number): string {
  const size = Math.abs(beside);
  return plain(Number(value.toFixed(size < 10 ? 2 : size < 100 ? 1 : 0)));
}
