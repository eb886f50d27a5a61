/**
 * The motion that a link holds least, in words of a survey: which of the six it is (three shifts, the heading, two tilts), along
 * or about which direction in plan.
 *
 * plan.json gives it by the axes of the scene. Here north is +y, up on every map.
 */
import { decimal, t } from '../language/language.ts';
import type { WeakMotion } from '../load/plan-json.ts';

export interface MotionWords {
  /** For a line of a list: "tilt about NW–SE". */
  readonly short: string;
  /** With its direction in degrees. */
  readonly long: string;
  /** What of the shared surface leaves it free, and what would hold it. */
  readonly why: string;
}

/** Which way the words call north. `toMap`: rows from the scene's coordinates to the map's; null: nobody knows. */
export function northHint(toMap: readonly (readonly number[])[] | null): string {
  const north = t('North is up on the maps: y of the model');
  const [x, y] = toMap?.[1] ?? [0, 1];
  const turnDeg = degrees(Math.atan2(x, y));
  if (Math.abs(turnDeg) < LEAST_TURN_DEG) return `${north}.`;
  const turn = decimal(Math.abs(turnDeg), 0);
  const grid =
    turnDeg > 0
      ? t('Grid north is {turn}° clockwise from it.', { turn })
      : t('Grid north is {turn}° anticlockwise from it.', { turn });
  return `${north}. ${grid}`;
}

/** Turned less than this, the two norths are one to a reader. */
const LEAST_TURN_DEG = 0.5;
/** Directions steeper than this have no direction in plan, those flatter are level. */
const STEEP_DEG = 80;
const LEVEL_DEG = 10.5;

const LINES = [t('N–S'), t('NE–SW'), t('E–W'), t('NW–SE')];
const SIDES = [t('N'), t('NE'), t('E'), t('SE'), t('S'), t('SW'), t('W'), t('NW')];

/** Null: not known. */
export function weakMotionOf(motion: WeakMotion | null): MotionWords | null {
  if (motion === null) return null;
  const [isTurn, axis] = [motion.kind === 'turn', motion.direction];
  const riseDeg = degrees(Math.atan2(Math.abs(axis[2]), Math.hypot(axis[0], axis[1])));
  if (riseDeg >= STEEP_DEG) return isTurn ? HEADING : HEIGHT;
  // Up along the line, whichever way the axis is given.
  const [x, y] = axis[2] < 0 ? [-axis[0], -axis[1]] : axis;
  const bearingDeg = (degrees(Math.atan2(x, y)) + 360) % 360;
  if (riseDeg <= LEVEL_DEG) return isTurn ? tilt(bearingDeg) : shift(bearingDeg);
  const rising = t('rising {rise}° towards {side}', { rise: decimal(riseDeg, 0), side: sideOf(bearingDeg) });
  if (!isTurn)
    return { short: t('shift on a slope'), long: t('shift along a line {rising}', { rising }), why: MORE_DIRECTIONS };
  return {
    short: t('turn about a slope'),
    long: t('rotation about a line {rising}', { rising }),
    why: MORE_DIRECTIONS,
  };
}

const MORE_DIRECTIONS = t('The shared surface faces too few directions; surface in other directions would fix it.');

const HEIGHT: MotionWords = {
  short: t('shift up–down'),
  long: t('shift up or down'),
  why: t('Hardly any shared surface is level; a floor or a ceiling would fix it.'),
};

const HEADING: MotionWords = {
  short: t('turn (heading)'),
  long: t('rotation about the vertical: the heading'),
  why: t('The shared walls are too close together, or around one point; a wall further out would fix it.'),
};

function shift(bearingDeg: number): MotionWords {
  const line = lineOf(bearingDeg);
  const [one, other] = line.split('–');
  return {
    short: t('shift {line}', { line }),
    long: t('shift along {line} (bearing {degrees}°)', { line, degrees: lineDegrees(bearingDeg) }),
    why: t('Hardly any shared surface faces {one} or {other}; a wall that does would fix it.', { one, other }),
  };
}

function tilt(bearingDeg: number): MotionWords {
  const line = lineOf(bearingDeg);
  const [one, other] = lineOf(bearingDeg + 90).split('–');
  return {
    short: t('tilt about {line}', { line }),
    long: t('tilt about a horizontal line {line} (bearing {degrees}°)', { line, degrees: lineDegrees(bearingDeg) }),
    why: t(
      'The shared surface lies close to that line; floor or ceiling further out to {one} or {other} would fix it.',
      { one, other },
    ),
  };
}

const degrees = (radians: number): number => (radians * 180) / Math.PI;
const lineDegrees = (bearingDeg: number): number => Math.round(bearingDeg) % 180;
const lineOf = (bearingDeg: number): string => LINES[Math.round(bearingDeg / 45) % LINES.length];
const sideOf = (bearingDeg: number): string => SIDES[Math.round(bearingDeg / 45) % SIDES.length];
