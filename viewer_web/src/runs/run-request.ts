/** What a run requires: the fields of the form, and the request they make (entries as in docs/formats/requirements.md). */

import type { RunRequest } from '../api/documents.ts';
import { plain, t } from '../language/language.ts';

export type Objective = 'fewest' | 'coverage' | 'time';
export type NetworkKind = 'connected' | 'redundant' | 'none';
/** Where registration starts; empty: as the scanner has it. */
export type PreAlignment = '' | 'tracked' | 'manual' | 'level' | 'none';

/** Fields as they are typed: empty means not required. */
export interface RunForm {
  readonly title: string;
  readonly objective: Objective;
  readonly maxStations: string;
  readonly coveragePercent: string;
  readonly overlapPercent: string;
  readonly network: NetworkKind;
  readonly preAlignment: PreAlignment;
  readonly linkProbabilityPercent: string;
  readonly spacingMm: string;
  readonly rangeM: string;
  readonly incidenceDeg: string;
  readonly noiseMm: string;
  readonly seenFrom: string;
  /** Ids; none: all. */
  readonly floors: readonly string[];
  readonly fromReview: boolean;
  readonly timeLimitS: string;
}

export type NumberField = Exclude<
  keyof RunForm,
  'title' | 'objective' | 'network' | 'preAlignment' | 'floors' | 'fromReview'
>;

interface FieldRule {
  readonly label: string;
  readonly unit: string;
  /** Smallest and largest value taken. */
  readonly range: readonly [number, number];
  /** The largest is not taken itself. */
  readonly isBelow?: boolean;
  readonly isWhole?: boolean;
  readonly hint: string;
}

export const FIELD_RULES: Readonly<Record<NumberField, FieldRule>> = {
  coveragePercent: { label: t('Coverage'), unit: '%', range: [1, 100], hint: t('Share of the scannable area') },
  overlapPercent: { label: t('Overlap'), unit: '%', range: [0, 100], hint: t('Minimum overlap of a link; 0: none') },
  linkProbabilityPercent: {
    label: t('Link probability'),
    unit: '%',
    range: [0, 100],
    isBelow: true,
    hint: t('Minimum probability with which the two scans of a link register; 0: none'),
  },
  spacingMm: { label: t('Spacing'), unit: 'mm', range: [0.1, 100_000], hint: t('Maximum point spacing') },
  rangeM: { label: t('Range'), unit: 'm', range: [0.1, 10_000], hint: t('Maximum range') },
  incidenceDeg: { label: t('Incidence'), unit: 'deg', range: [1, 90], hint: t('Maximum angle of incidence') },
  noiseMm: {
    label: t('Range noise'),
    unit: 'mm',
    range: [0.01, 1000],
    hint: t('One sigma; the scanner must state its own'),
  },
  seenFrom: {
    label: t('Seen from'),
    unit: t('stations'),
    range: [1, 10],
    isWhole: true,
    hint: t('Minimum stations per surface'),
  },
  maxStations: {
    label: t('Stations'),
    unit: '',
    range: [1, 10_000],
    isWhole: true,
    hint: t('Maximum number of stations'),
  },
  timeLimitS: { label: t('Time limit'), unit: 's', range: [1, 86_400], hint: t('The best plan so far is kept') },
};

/** What a number is, or what is wrong with how it was typed. */
export function numberOf(form: RunForm, field: NumberField): { value: number | null } | { fault: string } {
  const typed = form[field].trim().replace(',', '.');
  const { label, unit, range, isBelow, isWhole } = FIELD_RULES[field];
  if (typed === '') return { value: null };
  const value = Number(typed);
  const [low, high] = range.map(plain) as [string, string];
  const words = isBelow ? t('{low} to below {high}', { low, high }) : t('{low} to {high}', { low, high });
  const limits = `${words}${unit === '' ? '' : ` ${unit}`}`;
  if (!Number.isFinite(value)) return { fault: t('{label}: a number from {limits}', { label, limits }) };
  if (value < range[0] || value > range[1] || (isBelow && value === range[1])) return { fault: `${label}: ${limits}` };
  if (isWhole && !Number.isInteger(value)) return { fault: t('{label}: a whole number', { label }) };
  return { value };
}

/** What is wrong with the form, one line a field. */
export function faultsOf(form: RunForm): Partial<Record<NumberField, string>> {
  const faults: Partial<Record<NumberField, string>> = {};
  for (const field of Object.keys(FIELD_RULES) as NumberField[]) {
    const read = numberOf(form, field);
    if ('fault' in read) faults[field] = read.fault;
  }
  if (form.objective === 'coverage' && form.maxStations.trim() === '') {
    faults.maxStations = t('Stations: enter the number of stations for the most coverage');
  }
  return faults;
}

/** The request; throws where `faultsOf` finds something. */
export function requestOf(form: RunForm): RunRequest {
  const value = (field: NumberField): number | null => {
    const read = numberOf(form, field);
    if ('fault' in read) throw new RangeError(read.fault);
    return read.value;
  };
  const withUnit = (field: NumberField, unit: string): string | undefined => {
    const number = value(field);
    return number === null ? undefined : `${number} ${unit}`;
  };
  const requirements: Record<string, unknown> = {
    coverage: withUnit('coveragePercent', '%'),
    overlap: withUnit('overlapPercent', '%'),
    network: form.network,
    pre_alignment: form.preAlignment === '' ? undefined : form.preAlignment,
    link_probability: withUnit('linkProbabilityPercent', '%'),
    spacing: withUnit('spacingMm', 'mm'),
    range: withUnit('rangeM', 'm'),
    incidence: withUnit('incidenceDeg', 'deg'),
    noise: withUnit('noiseMm', 'mm'),
    seen_from: value('seenFrom') ?? undefined,
    planned_floors: form.floors.length > 0 ? form.floors : undefined,
  };
  return {
    title: form.title.trim(),
    requirements: Object.fromEntries(Object.entries(requirements).filter(([, entry]) => entry !== undefined)),
    objective: form.objective,
    // Only this objective has a number of stations of its own.
    max_stations: form.objective === 'coverage' ? value('maxStations') : null,
    from_review: form.fromReview,
    from_drawing: false,
    time_limit_s: value('timeLimitS'),
  };
}

/** What a plan was asked, as far as it says. */
export interface AskedOfPlan {
  readonly coverage: number;
  readonly overlap: number;
  readonly seen_from?: number | undefined;
  readonly network?: string | undefined;
  readonly pre_alignment?: Exclude<PreAlignment, ''> | null | undefined;
  readonly min_probability?: number | undefined;
  readonly floors?: readonly string[] | undefined;
  readonly asked?:
    | {
        readonly spacing_m: number | null;
        readonly range_m: number | null;
        readonly incidence_rad: number | null;
        readonly noise_m: number | null;
      }
    | undefined;
}

/** What a plan says of its network; plans of earlier versions say loops, and joined. */
function networkOf(word: string | undefined): NetworkKind {
  if (word === 'redundant' || word === 'loops') return 'redundant';
  return word === 'none' ? 'none' : 'connected';
}

/** The form that asks again what the plan was asked. */
export function formFrom(asked: AskedOfPlan): RunForm {
  const typed = (value: number | null | undefined, scale: number): string =>
    value === null || value === undefined ? '' : String(Number((value * scale).toPrecision(6)));
  const limits = asked.asked;
  return {
    title: '',
    objective: 'fewest',
    maxStations: '',
    coveragePercent: typed(asked.coverage, 100),
    overlapPercent: typed(asked.overlap, 100),
    network: networkOf(asked.network),
    preAlignment: asked.pre_alignment ?? '',
    linkProbabilityPercent: typed(asked.min_probability, 100),
    spacingMm: typed(limits?.spacing_m, 1000),
    rangeM: typed(limits?.range_m, 1),
    incidenceDeg: typed(limits?.incidence_rad, 180 / Math.PI),
    noiseMm: typed(limits?.noise_m, 1000),
    seenFrom: typed(asked.seen_from, 1),
    floors: asked.floors ?? [],
    fromReview: true,
    timeLimitS: '',
  };
}
