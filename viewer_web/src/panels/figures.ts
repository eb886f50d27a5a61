/** Figures as the panels write them. */
import type { PlanJson } from '../load/plan-json.ts';
import { FOOT_M, feetAndInches, units } from './units.ts';

const area = new Intl.NumberFormat('en', { maximumFractionDigits: 1, minimumFractionDigits: 1 });
/** Halves to even, as Python formats. */
const tenths = new Intl.NumberFormat('en', {
  minimumFractionDigits: 1,
  maximumFractionDigits: 1,
  roundingMode: 'halfEven',
  useGrouping: false,
  // Newer than the library's types.
} as Intl.NumberFormatOptions);
const count = new Intl.NumberFormat('en');

export const percent = (fraction: number, digits = 1): string => `${(100 * fraction).toFixed(digits)} %`;
/**
 * Rounded down: an overlap or a coverage that is just short must not read as enough. As `overlap_percent` of the library,
 * digit by digit: `thousandths / 1000` is the float that a decimal of three places is read as.
 */
export function percentDown(fraction: number): string {
  const nearest = Math.round(1000 * fraction);
  const thousandths = nearest / 1000 > fraction ? nearest - 1 : nearest;
  return `${(thousandths / 10).toFixed(1)} %`;
}
/**
 * Coverage, wherever it is told: rounded down where it would read as what is required and is not. As `reached_percent` of the
 * library, whose report and sheets tell it so.
 */
export function coveragePercent(fraction: number, required: number): string {
  const words = tenths.format(100 * fraction);
  const isShort = fraction < required - 1e-9 && Number(words) >= 100 * required;
  return isShort ? `${(Math.floor(1000 * fraction) / 10).toFixed(1)} %` : `${words} %`;
}
/** What was asked for, with as many digits as it was asked with: an overlap of 29.6 % is not less than one of 30 % then. */
export const askedPercent = (fraction: number): string => `${Number((100 * fraction).toPrecision(6))} %`;
type OverlapAsked = Pick<PlanJson['requirements'], 'overlap_measure' | 'overlap_of'>;
/** What a share is one of; as `overlap_noun` of the library: the usual overlap goes by that name alone. */
export function overlapNoun({ overlap_measure: measure, overlap_of: of }: OverlapAsked): string {
  const noun = measure === 'jaccard' ? 'Jaccard overlap' : 'overlap';
  return of === 'all-seen' ? noun : `${noun} of what is seen as required`;
}
/** How a plan measures overlap, in a sentence. */
export function overlapDefined({ overlap_measure: measure, overlap_of: of }: OverlapAsked): string {
  const seen = of === 'all-seen' ? 'seen area' : 'area seen as required';
  return measure === 'jaccard'
    ? `Shared part of the ${seen} of both stations together (Jaccard)`
    : `Shared part of the ${seen} of each station; the smaller of the two`;
}
/** Square decimetres are told where there is nothing else to tell; square feet are a tenth of a square metre. */
export function areaWords(m2: number): string {
  if (units.value === 'ft') return `${area.format(m2 / FOOT_M ** 2)} sq ft`;
  return m2 > 0 && m2 < 0.05 ? `${m2.toFixed(2)} m²` : `${area.format(m2)} m²`;
}
/** Metres with so many digits; feet and inches, to an eighth for two digits, to an inch for one, to a foot for none. */
export function lengthWords(m: number, digits = 2): string {
  if (units.value === 'm') return `${m.toFixed(digits)} m`;
  return digits === 0 ? `${(m / FOOT_M).toFixed(0)} ft` : feetAndInches(m, digits === 1 ? 1 : 8);
}
/** A coordinate: decimals, of metres or of feet. */
export const coordinateWords = (m: number, digits = 2): string =>
  units.value === 'm' ? `${m.toFixed(digits)} m` : `${(m / FOOT_M).toFixed(digits)} ft`;
/** Several, without their unit, as they stand side by side. */
export const coordinatesWords = (ofPlace: readonly number[]): string =>
  ofPlace.map((m) => (units.value === 'm' ? m : m / FOOT_M).toFixed(2)).join(', ');
export const unitName = (): string => (units.value === 'm' ? 'metres' : 'feet');
/** Of a sensor above the ground; null: of a given station, whose height nobody told. */
export const heightWords = (m: number | null): string => (m === null ? 'not known' : lengthWords(m));
export const whole = (n: number): string => count.format(n);

/** "45 s", "3 min", "2 h 05 min". */
export function duration(seconds: number): string {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  if (minutes < 60) return `${minutes} min`;
  return `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, '0')} min`;
}

/** "1 station", "2 stations". */
export const counted = (n: number, noun: string): string => `${whole(n)} ${noun}${n === 1 ? '' : 's'}`;

/** An IFC class or mesh kind as a word: "IfcWallStandardCase" becomes "wall standard case". */
export function kindInWords(kind: string): string {
  const words = kind.replace(/^Ifc/, '').replace(/([a-z])([A-Z])/g, '$1 $2');
  return words.toLowerCase();
}

/** "up to 2 stations above the minimum". */
export function optimalityInWords({
  proven,
  gap,
  stations,
  lower_bound: bound,
}: Pick<PlanJson['optimality'], 'proven' | 'gap' | 'stations' | 'lower_bound'>): string {
  if (proven) return 'proven minimum';
  if (gap === null || bound === null) return 'unknown';
  return `up to ${counted(stations - bound, 'station')} above the minimum`;
}
