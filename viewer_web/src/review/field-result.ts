/** What a crew saved from the field file, as changes of the review. */

import type { Change, Point } from '../api/documents.ts';
import type { DraftStation } from '../edit/draft.ts';
import { decimal, t } from '../language/language.ts';
import { counted, lengthWords } from '../panels/figures.ts';
import { type Progress, type ProgressState, setProgress } from './progress.ts';

export interface FieldStation {
  readonly id: string;
  readonly state: ProgressState | null;
  /** Where it stood on site, (x, y), scene frame; null: where it was planned. */
  readonly movedTo: readonly [number, number] | null;
  readonly note: string;
  readonly photo: boolean;
}

export interface FieldResult {
  readonly planSha256: string;
  /** Of the review that the file was made of. */
  readonly revision: number;
  readonly name: string;
  readonly savedAt: string;
  readonly stations: readonly FieldStation[];
}

/** Of stations that are left; of more their number is told. */
const MOST_NAMED = 12;

export const FIELD_SCHEMA = 'tlsplan/field/1';

/** Throws an error in words where it is no such file. */
export function readFieldResult(text: string): FieldResult {
  let told: unknown;
  try {
    told = JSON.parse(text);
  } catch {
    throw new Error(t('The file is no JSON, expected what the field file saves. Choose another file.'));
  }
  const file = told as Record<string, unknown>;
  if (typeof told !== 'object' || told === null || file.schema !== FIELD_SCHEMA) {
    throw new Error(
      t('The file is no {schema}, expected what the field file saves. Choose another file.', { schema: FIELD_SCHEMA }),
    );
  }
  const { plan_sha256, revision, name, saved_at, stations } = file;
  const isWhole = typeof revision === 'number' && Number.isInteger(revision) && revision >= 0;
  const isText = [plan_sha256, name, saved_at].every((value) => typeof value === 'string');
  if (!isWhole || !isText || !Array.isArray(stations)) throw damaged(t('its head'));
  return {
    planSha256: plan_sha256 as string,
    revision: revision as number,
    name: name as string,
    savedAt: saved_at as string,
    stations: stations.map(readStation),
  };
}

function readStation(told: unknown): FieldStation {
  const { id, state, moved_to, note, photo } = (told ?? {}) as Record<string, unknown>;
  const isPlace = (value: unknown): boolean =>
    Array.isArray(value) && value.length === 2 && value.every((each) => Number.isFinite(each));
  const isRight =
    typeof id === 'string' &&
    (state === null || state === 'done' || state === 'skipped') &&
    (moved_to === null || isPlace(moved_to)) &&
    typeof note === 'string' &&
    typeof photo === 'boolean';
  if (!isRight) throw damaged(t('station {id}', { id: typeof id === 'string' ? id : '?' }));
  return { id, state, movedTo: moved_to as FieldStation['movedTo'], note, photo };
}

const damaged = (where: string): Error =>
  new Error(t('The field result is damaged at {where}. Save it from the phone again.', { where }));

/** A station that stood elsewhere on site, and may be moved there. */
export interface FieldMove {
  readonly station: DraftStation;
  readonly to: readonly [number, number];
  readonly awayM: number;
}

export function movesOfField(result: FieldResult, stations: readonly DraftStation[]): FieldMove[] {
  return result.stations.flatMap(({ id, movedTo }): FieldMove[] => {
    const station = stations.find((one) => one.id === id);
    if (station === undefined || movedTo === null || !canMove(station)) return [];
    return [{ station, to: movedTo, awayM: awayOf(movedTo, station) }];
  });
}

const awayOf = ([x, y]: readonly [number, number], { positionM }: DraftStation): number =>
  Math.hypot(x - positionM[0], y - positionM[1]);

/**
 * The changes that take a result into the review: moved stations are moved, what is done or skipped is marked so, what was said of a station
 * is a comment on it, and how far the crew came is a comment on the plan. Ids of the comments follow from the file: taken in twice, it is a conflict and not two of each.
 */
export function changesOfField(
  result: FieldResult,
  stations: readonly DraftStation[],
  rejected: ReadonlySet<string> = new Set(),
  progress: Progress = {},
): Change[] {
  const byId = new Map(stations.map((station) => [station.id, station]));
  const unknown = result.stations.filter(({ id }) => !byId.has(id)).map(({ id }) => id);
  if (unknown.length > 0)
    throw new Error(
      t('The field result names {stations}, which the review does not have.', { stations: unknown.join(', ') }),
    );
  const moved = movesOfField(result, stations).filter(({ station }) => !rejected.has(station.id));
  const isMoved = new Set(moved.map(({ station }) => station.id));
  const stamp = Number(result.savedAt.replace(/\D/g, '')).toString(36);
  const told = result.stations.flatMap((station, n): Change[] => {
    const text = wordsOf(station, byId.get(station.id)!, { isMoved: isMoved.has(station.id), name: result.name });
    return text === null ? [] : [{ kind: 'add_comment', id: `F${stamp}_${n + 1}`, text, target: station.id }];
  });
  return [
    ...moved.map(({ station: { id, positionM, instrumentHeightM, floorId }, to: [x, y] }): Change => {
      const position_m: Point = [x, y, positionM[2]];
      return { kind: 'move_station', station: id, position_m, instrument_height_m: instrumentHeightM, floor: floorId };
    }),
    // Those that this crew did not come to may be another crew's.
    ...result.stations.flatMap(({ id, state }): Change[] =>
      state === null || state === progress[id]?.state || byId.get(id)!.isRemoved ? [] : [setProgress(id, state)],
    ),
    ...told,
    { kind: 'add_comment', id: `F${stamp}_0`, text: summaryOf(result, stations), target: null },
  ];
}

const canMove = ({ isLocked, isFixed, isRemoved }: DraftStation): boolean => !isLocked && !isFixed && !isRemoved;

/** What is to be known of a station beyond that it is done; null: nothing. */
function wordsOf(
  { state, movedTo, note, photo }: FieldStation,
  station: DraftStation,
  { isMoved, name }: { readonly isMoved: boolean; readonly name: string },
): string | null {
  const away = movedTo === null ? 0 : awayOf(movedTo, station);
  const parts = [
    state === 'skipped' && t('skipped'),
    movedTo !== null &&
      (isMoved
        ? t('set up {length} away', { length: lengthWords(away) })
        : t('set up {length} away to x {x}, y {y}, and not moved here', {
            length: lengthWords(away),
            x: decimal(movedTo[0], 2),
            y: decimal(movedTo[1], 2),
          })),
    note.trim() !== '' && note.trim(),
    photo && t('photo taken'),
  ].filter((part) => part !== false);
  if (parts.length === 0) return null;
  const words = parts.join('; ');
  return name === '' ? t('On site: {words}', { words }) : t('On site ({name}): {words}', { name, words });
}

function summaryOf({ name, stations }: FieldResult, all: readonly DraftStation[]): string {
  const planned = all.filter(({ isRemoved, isFixed }) => !isRemoved && !isFixed);
  const of = (state: FieldStation['state']): string[] =>
    stations.filter((station) => station.state === state).map(({ id }) => id);
  const through = new Set([...of('done'), ...of('skipped')]);
  const left = planned.filter(({ id }) => !through.has(id)).map(({ id }) => id);
  const parts = [
    t('{n} of {all, plural, one {# station} other {# stations}} done: {stations}', {
      n: of('done').length,
      all: planned.length,
      stations: of('done').join(', ') || t('none'),
    }),
    of('skipped').length > 0 && t('skipped: {stations}', { stations: of('skipped').join(', ') }),
    left.length > 0 &&
      t('left: {stations}', {
        stations: left.length > MOST_NAMED ? counted(left.length, 'station') : left.join(', '),
      }),
  ].filter((part) => part !== false);
  const words = parts.join('; ');
  return name === '' ? t('Field result. {words}.', { words }) : t('Field result of {name}. {words}.', { name, words });
}
