/** Figures as the panels write them. */
import { decimal, language, plain, separator, t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { FOOT_M, feetAndInches, units } from './units.ts';

const area = new Intl.NumberFormat(language, { maximumFractionDigits: 1, minimumFractionDigits: 1 });
const count = new Intl.NumberFormat(language);

export const percent = (fraction: number, digits = 1): string => `${decimal(100 * fraction, digits)} %`;
/** Of a percentage, as Python formats it: exact, halves to even. */
const tenths = (of100: number): string => (of100 % 1 === 0.25 ? of100 - 0.05 : of100).toFixed(1);
/**
 * A coverage or an overlap, wherever it is shown: rounded, and `just below 30 %` where it would read as the 30 % required and is
 * less. As `reached_percent` of the library, whose report and sheets have it.
 */
export function reachedPercent(fraction: number, required: number): string {
  const words = tenths(100 * fraction);
  const isShort = fraction < required - 1e-9 && Number(words) >= Number((100 * required).toPrecision(6));
  return isShort ? t('just below {percent}', { percent: askedPercent(required) }) : `${decimal(Number(words), 1)} %`;
}
/** What was asked for, with as many digits as it was asked with: an overlap of 29.6 % is not less than one of 30 % then. */
/** Of a probability; never more than 99.9 %: nothing is certain. */
export const probabilityPercent = (probability: number, required: number): string =>
  reachedPercent(Math.min(probability, 0.999), required);

export const askedPercent = (fraction: number): string => `${plain(Number((100 * fraction).toPrecision(6)))} %`;
type OverlapAsked = Pick<PlanJson['requirements'], 'overlap_measure' | 'overlap_of'>;
/** What a share is one of; as `overlap_noun` of the library: the usual overlap goes by that name alone. */
export function overlapNoun({ overlap_measure: measure, overlap_of: of }: OverlapAsked): string {
  const noun = measure === 'jaccard' ? t('Jaccard overlap') : t('overlap');
  return of === 'all-seen' ? noun : t('{overlap} of what is seen as required', { overlap: noun });
}
/** How a plan measures overlap, in a sentence. */
export function overlapDefined({ overlap_measure: measure, overlap_of: of }: OverlapAsked): string {
  const seen = of === 'all-seen' ? t('seen area') : t('area seen as required');
  return measure === 'jaccard'
    ? t('Shared part of the {area} of both stations together (Jaccard)', { area: seen })
    : t('Shared part of the {area} of each station; the smaller of the two', { area: seen });
}
/** Square decimetres are told where there is nothing else to tell; square feet are a tenth of a square metre. */
export function areaWords(m2: number): string {
  if (units.value === 'ft') return `${area.format(m2 / FOOT_M ** 2)} sq ft`;
  return m2 > 0 && m2 < 0.05 ? `${decimal(m2, 2)} m²` : `${area.format(m2)} m²`;
}
/** Metres with so many digits; feet and inches, to an eighth for two digits, to an inch for one, to a foot for none. */
export function lengthWords(m: number, digits = 2): string {
  if (units.value === 'm') return `${decimal(m, digits)} m`;
  return digits === 0 ? `${decimal(m / FOOT_M, 0)} ft` : feetAndInches(m, digits === 1 ? 1 : 8);
}
/** A coordinate: decimals, of metres or of feet. */
export const coordinateWords = (m: number, digits = 2): string =>
  units.value === 'm' ? `${decimal(m, digits)} m` : `${decimal(m / FOOT_M, digits)} ft`;
/** Several, without their unit, as they stand side by side. */
export const coordinatesWords = (ofPlace: readonly number[]): string =>
  ofPlace.map((m) => decimal(units.value === 'm' ? m : m / FOOT_M, 2)).join(separator);
/** A length or time of a route, beside it the legs that it leaves out as no way inside the model leads along them. */
export const alongWays = (figure: string, nWithoutWay: number): string =>
  nWithoutWay === 0
    ? figure
    : t('{figure}, without {n, plural, one {# leg that has no way} other {# legs that have no way}}', {
        figure,
        n: nWithoutWay,
      });
export const unitName = (): string => (units.value === 'm' ? t('metres') : t('feet'));
/** Of a sensor above the ground; null: of a given station, whose height nobody told. */
export const heightWords = (m: number | null): string => (m === null ? t('not known') : lengthWords(m));
export const whole = (n: number): string => count.format(n);

/** "45 s", "3 min", "2 h 05 min". */
export function duration(seconds: number): string {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  if (minutes < 60) return `${minutes} min`;
  return `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, '0')} min`;
}

const COUNTED = {
  area: (n: number) => t('{n, plural, one {# area} other {# areas}}', { n }),
  change: (n: number) => t('{n, plural, one {# change} other {# changes}}', { n }),
  link: (n: number) => t('{n, plural, one {# link} other {# links}}', { n }),
  other: (n: number) => t('{n, plural, one {# other station} other {# other stations}}', { n }),
  requirement: (n: number) => t('{n, plural, one {# requirement} other {# requirements}}', { n }),
  station: (n: number) => t('{n, plural, one {# station} other {# stations}}', { n }),
  warning: (n: number) => t('{n, plural, one {# warning} other {# warnings}}', { n }),
};

/** "1 station", "2 stations". */
export const counted = (n: number, noun: keyof typeof COUNTED): string => COUNTED[noun](n);

/** What buildings have most of; other classes are told as the file names them. */
const KINDS: Readonly<Record<string, string>> = {
  beam: t('beam'),
  'building element proxy': t('building element proxy'),
  ceiling: t('ceiling'),
  column: t('column'),
  covering: t('covering'),
  'curtain wall': t('curtain wall'),
  door: t('door'),
  floor: t('floor'),
  'flow terminal': t('flow terminal'),
  furnishing: t('furnishing'),
  'furnishing element': t('furnishing element'),
  furniture: t('furniture'),
  member: t('member'),
  object: t('object'),
  plate: t('plate'),
  railing: t('railing'),
  ramp: t('ramp'),
  roof: t('roof'),
  slab: t('slab'),
  stair: t('stair'),
  'stair flight': t('stair flight'),
  wall: t('wall'),
  'wall standard case': t('wall standard case'),
  window: t('window'),
};

/** An IFC class or mesh kind as a word: "IfcWallStandardCase" becomes "wall standard case". */
export function kindInWords(kind: string): string {
  const words = kind.replace(/^Ifc/, '').replace(/([a-z])([A-Z])/g, '$1 $2');
  const known = words.toLowerCase();
  return KINDS[known] ?? known;
}

/** "up to 2 stations above the minimum". */
export function optimalityInWords({
  proven,
  gap,
  stations,
  lower_bound: bound,
}: Pick<PlanJson['optimality'], 'proven' | 'gap' | 'stations' | 'lower_bound'>): string {
  if (proven) return t('proven minimum');
  if (gap === null || bound === null) return t('unknown');
  return t('up to {stations} above the minimum', { stations: counted(stations - bound, 'station') });
}
