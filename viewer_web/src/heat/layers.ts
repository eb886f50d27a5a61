/** What the building can be painted by: values of its patches, and the colours and words they get. */
import { t } from '../language/language.ts';

/** A colour, or one for light and one for dark pages. */
export type ThemedColor = string | { readonly light: string; readonly dark: string };

export interface HeatClass {
  /** A patch with this value, 0 ... 255. */
  readonly value: number;
  readonly label: string;
  readonly color: ThemedColor;
}

/** Values that are names: each has its own colour. */
export interface ClassLayer {
  readonly kind: 'classes';
  readonly id: string;
  readonly title: string;
  /** Id of the values it shows, where that is not its own. */
  readonly valuesOf?: string;
  readonly classes: readonly HeatClass[];
}

/** Values that are quantities, `value * step` in `unit`; `none`: not known, or seen by no station. */
export interface RampLayer {
  readonly kind: 'ramp';
  readonly id: string;
  readonly title: string;
  readonly unit: string;
  readonly step: number;
  readonly none: number;
  readonly better: 'low' | 'high';
}

export type HeatLayer = ClassLayer | RampLayer;

/** One value a patch. */
export type PatchValues = Uint8Array | Uint16Array;

export const TIMES_SEEN = 'times_seen';
export const PLAIN = 'plain';
/** Value of `times_seen` where no candidate sees the patch. */
export const NOT_ACHIEVABLE = 255;
/** Value of `times_seen`, in the viewer alone, of patches that need not be covered, see heat/scope.ts. */
export const NOT_ASKED = 254;

const UNSEEN = '#e8833a';
const SEEN = ['#a9d9d3', '#62b6b7', '#2b8a9b', '#17607a'] as const;
const GREY: ThemedColor = { light: '#c6cacc', dark: '#6d757a' };
/** Paler than what can't be seen: nothing was tried there. */
export const PALE: ThemedColor = { light: '#eef0f1', dark: '#42494e' };
export const NOT_ASKED_CLASS: HeatClass = { value: NOT_ASKED, label: t('not to be covered'), color: PALE };

/** Of viewer/patches.u8: how many stations see it. */
export const TIMES_SEEN_LAYER: ClassLayer = {
  kind: 'classes',
  id: TIMES_SEEN,
  title: t('Station count'),
  classes: [
    { value: 1, label: '1', color: SEEN[0] },
    { value: 2, label: '2', color: SEEN[1] },
    { value: 3, label: '3', color: SEEN[2] },
    { value: 4, label: '4+', color: SEEN[3] },
    { value: 0, label: t('unseen'), color: UNSEEN },
    NOT_ASKED_CLASS,
    { value: NOT_ACHIEVABLE, label: t('not scannable'), color: GREY },
  ],
};

const SEEN_LAYER: ClassLayer = {
  kind: 'classes',
  id: 'seen',
  title: t('Seen or unseen'),
  valuesOf: TIMES_SEEN,
  classes: [
    { value: 1, label: t('seen'), color: SEEN[1] },
    { value: 0, label: t('unseen'), color: UNSEEN },
    NOT_ASKED_CLASS,
    { value: NOT_ACHIEVABLE, label: t('not scannable'), color: GREY },
  ],
};

export const REASON = 'reason';
/** Value of `reason` of patches without a requirement: out of scope, of other floors, or of obstacles. */
export const OUT_OF_SCOPE = 255;
/** By reason: what a further station would mend is warm, what the scanner can't do is cool, what nobody can is grey. */
/** Not in files: what stations would see, and those of the edited plan do not. */
export const LEFT_BY_EDITS = 'left unseen by edits';
const REASON_COLORS: Readonly<Record<string, ThemedColor>> = {
  covered: { light: '#dfe9e6', dark: '#54635f' },
  'not worth a station': '#e8833a',
  [LEFT_BY_EDITS]: '#e8833a',
  'too few spots see it': '#d4a017',
  'out of range': '#3f7fd0',
  'outside the field of view': '#7a5cc9',
  'too oblique': '#c45a9b',
  'too sparse': '#2f9aa8',
  'too noisy': '#5a9e4b',
  'returns no beam': '#274c77',
  occluded: '#b3262e',
  'no admissible spot': '#7d4f2a',
  'inside solids': GREY,
};

export function reasonColor(reason: string): ThemedColor {
  return REASON_COLORS[reason] ?? GREY;
}

/** Reasons by their names in plan.json; some of them the field calls otherwise. */
export const REASON_WORDS: Readonly<Record<string, string>> = {
  covered: t('covered'),
  'out of range': t('out of range'),
  'outside the field of view': t('outside the field of view'),
  'too oblique': t('too oblique'),
  'too sparse': t('too sparse'),
  'too noisy': t('too noisy'),
  occluded: t('occluded'),
  'inside solids': t('inside solids'),
  'not worth a station': t('reachable, left out'),
  'too few spots see it': t('seen from too few positions'),
  'returns no beam': t('no return'),
  'no admissible spot': t('no valid tripod position'),
};

export function reasonInWords(reason: string): string {
  return reason === LEFT_BY_EDITS ? t('left unseen by edits') : (REASON_WORDS[reason] ?? reason);
}

function reasonLayer(reasons: readonly string[]): ClassLayer {
  const ofReason = reasons.map((reason, value) => ({
    value,
    label: reasonInWords(reason),
    color: reasonColor(reason),
  }));
  return {
    kind: 'classes',
    id: REASON,
    title: t('Why unseen'),
    classes: [...ofReason, { ...NOT_ASKED_CLASS, value: OUT_OF_SCOPE }],
  };
}

/** As the plan folder names them. */
const RAMP_TITLES: Readonly<Record<string, string>> = {
  range: t('Best range'),
  incidence: t('Best incidence'),
  spacing: t('Point spacing of all stations'),
  noise: t('Least range noise (one sigma)'),
};

/** All that a plan can be painted by: of its own layers and of further ones. */
export function layersOf(
  ramps: readonly RampLayer[],
  reasons: readonly string[],
  extra: readonly HeatLayer[],
): readonly HeatLayer[] {
  const why = reasons.length > 0 ? [reasonLayer(reasons)] : [];
  const named = ramps.map((ramp) => ({ ...ramp, title: RAMP_TITLES[ramp.id] ?? ramp.title }));
  return [TIMES_SEEN_LAYER, SEEN_LAYER, ...named, ...why, ...extra];
}

/** The classes that a legend tells of: what need not be covered only where there is such surface. */
export function legendClasses({ classes }: ClassLayer, hasNotAsked: boolean): readonly HeatClass[] {
  return hasNotAsked ? classes : classes.filter(({ label }) => label !== NOT_ASKED_CLASS.label);
}

/** Id of the values that a layer shows. */
export function valuesOf(layer: HeatLayer): string {
  return layer.kind === 'classes' ? (layer.valuesOf ?? layer.id) : layer.id;
}
