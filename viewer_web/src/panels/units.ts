/** The unit that people read lengths, areas and coordinates in; kept by the browser. Everything else is metres. */
import { signal } from '@preact/signals';

export type Units = 'm' | 'ft';
export type UnitStorage = Pick<Storage, 'getItem' | 'setItem'>;

/** The international foot. The US survey foot is the same to a millionth: it matters for site coordinates only. */
export const FOOT_M = 0.3048;
const INCH_M = 0.0254;
const KEY = 'tlsplan-units';

export const units = signal<Units>('m');

/** Take the unit of the last visit; anything but feet is metres. */
export function restoreUnits(storage: UnitStorage): void {
  units.value = storage.getItem(KEY) === 'ft' ? 'ft' : 'm';
}

export function chooseUnits(storage: UnitStorage, chosen: Units): void {
  units.value = chosen;
  storage.setItem(KEY, chosen);
}

/** `5' 3 1/4"`: to an inch in `parts`, a power of two; as `feet_and_inches` of the library. */
export function feetAndInches(m: number, parts = 8): string {
  const count = Math.round((Math.abs(m) / INCH_M) * parts);
  const [feet, rest] = [Math.floor(count / (12 * parts)), count % (12 * parts)];
  const [inches, part] = [Math.floor(rest / parts), rest % parts];
  let [over, under] = [part, parts];
  while (over > 0 && over % 2 === 0) [over, under] = [over / 2, under / 2];
  const sign = m < 0 && count > 0 ? '−' : '';
  return `${sign}${feet}' ${inches}${part > 0 ? ` ${over}/${under}` : ''}"`;
}

/** What is typed as a length, in metres: a number of the chosen unit, of `unitM` metres each, or `5' 3 1/4"`; null: it is none. */
export function parseLengthM(typed: string, unitM = units.value === 'm' ? 1 : FOOT_M): number | null {
  const text = typed.trim().replace('−', '-').replace(',', '.');
  const inFeet = /^(-?)(\d+)'\s*(?:(\d+)(?:\s+(\d+)\/(\d+))?\s*"?)?$/.exec(text);
  if (inFeet !== null) {
    const [feet, inches, part, whole] = inFeet.slice(2).map((digits) => Number(digits ?? 0));
    const m = feet * FOOT_M + (inches + (whole > 0 ? part / whole : 0)) * INCH_M;
    return inFeet[1] === '-' ? -m : m;
  }
  return /^-?(\d+\.?\d*|\.\d+)$/.test(text) ? Number(text) * unitM : null;
}
