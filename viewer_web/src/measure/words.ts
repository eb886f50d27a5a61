/** Measurements in words, in the chosen unit. */
import { decimal, t } from '../language/language.ts';
import { lengthWords } from '../panels/figures.ts';
import { FOOT_M, units } from '../panels/units.ts';
import { angleOf, areaOf, distanceOf, type PointM } from './geometry.ts';
import type { MeasureKind, Measurement } from './state.ts';

/** What it is a figure of, where it is not the usual one. */
export const titleOf = ({ kind, isInPlan }: Pick<Measurement, 'kind' | 'isInPlan'>): string =>
  isInPlan && kind !== 'height' ? t('{kind} in plan', { kind: KIND_WORDS[kind] }) : KIND_WORDS[kind];

export const KIND_WORDS: Readonly<Record<MeasureKind, string>> = {
  distance: t('Distance'),
  height: t('Height'),
  angle: t('Angle'),
  area: t('Area'),
};

/** Corners further off one plane than this are told. */
const FLAT_ENOUGH_M = 0.01;

export interface Result {
  /** What stands in the picture. */
  readonly main: string;
  /** Name and value of the rest. */
  readonly rest: readonly (readonly [string, string])[];
  readonly warning: string | null;
}

type Measured = Pick<Measurement, 'kind' | 'points' | 'isInPlan'>;

export function resultOf({ kind, points, isInPlan }: Measured): Result {
  const places = points.map(({ sceneM }) => sceneM);
  if (kind === 'angle') return ofAngle(places, isInPlan);
  // From above, corners of one wall are met at different heights.
  if (kind === 'area') return ofArea(isInPlan ? places.map(([x, y]) => [x, y, 0]) : places);
  const { straightM, levelM, riseM } = distanceOf(places[0], places[1]);
  const level = [t('Horizontal'), lengthWords(levelM, 3)] as const;
  if (kind === 'height') return { main: lengthWords(Math.abs(riseM), 3), rest: [level], warning: null };
  const [straight, rise] = [
    [t('Straight'), lengthWords(straightM, 3)],
    [t('Height difference'), signedLength(riseM)],
  ] as const;
  return isInPlan
    ? { main: level[1], rest: [straight, rise], warning: null }
    : { main: straight[1], rest: [level, rise], warning: null };
}

function ofAngle([a, at, b]: readonly PointM[], isInPlan: boolean): Result {
  const { angleRad, inPlanRad } = angleOf(a, at, b);
  if (isInPlan && inPlanRad !== null) {
    return { main: degrees(inPlanRad), rest: [[t('In space'), degrees(angleRad)]], warning: null };
  }
  const rest = inPlanRad === null ? [] : [[t('In plan'), degrees(inPlanRad)] as const];
  return { main: degrees(angleRad), rest, warning: null };
}

function ofArea(places: readonly PointM[]): Result {
  const { areaM2, perimeterM, offPlaneM, isCrossed } = areaOf(places);
  const off =
    offPlaneM > FLAT_ENOUGH_M
      ? t('Corners are up to {length} off one plane.', { length: lengthWords(offPlaneM) })
      : null;
  return {
    main: squareWords(areaM2),
    rest: [[t('Perimeter'), lengthWords(perimeterM, 3)]],
    warning: isCrossed ? t('Sides cross: this is no area.') : off,
  };
}

const degrees = (rad: number): string => `${decimal((rad * 180) / Math.PI, 2)}°`;
const squareWords = (m2: number): string =>
  units.value === 'm' ? `${decimal(m2, 2)} m²` : `${decimal(m2 / FOOT_M ** 2, 1)} sq ft`;

function signedLength(m: number): string {
  const words = lengthWords(Math.abs(m), 3);
  return m < 0 ? `−${words}` : `+${words}`;
}
