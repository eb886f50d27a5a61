/** How much of each room is seen, what most of the rest of it lacks, and which stations stand there. */
import { type ClassLayer, LEFT_BY_EDITS, NOT_ACHIEVABLE, NOT_ASKED, PALE } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import type { LayersJson } from '../load/layers.ts';
import { askedPercent } from '../panels/figures.ts';

export type PlanRoom = NonNullable<LayersJson['rooms']>['list'][number];

export interface RoomFigures {
  /** In layers.json. */
  readonly number: number;
  readonly name: string;
  readonly room: PlanRoom;
  readonly scannableM2: number;
  readonly seenM2: number;
  /** Seen share of the scannable area; null: none of it is scannable. */
  readonly coverage: number | null;
  /** Why most of what could be seen is not; null: all is, or no reason is known. */
  readonly unseen: ReasonArea | null;
  /** Why most of what no candidate sees is not scannable. */
  readonly hidden: ReasonArea | null;
}

export interface ReasonArea {
  readonly reason: string;
  readonly areaM2: number;
}

export interface PatchFigures {
  /** Room of each patch, `none` in none. */
  readonly roomOfPatch: Uint16Array;
  readonly timesSeen: Uint8Array;
  readonly areasM2: Float32Array;
  /** Into `reasons`; null: an older version made the plan. */
  readonly reasonOfPatch: ArrayLike<number> | null;
  readonly reasons: readonly string[];
  /** Stations that have to see a patch. */
  readonly seenFrom: number;
}

/** Of no use in a room: what lies in walls is no surface of it. */
const INSIDE_SOLIDS = 'inside solids';
const COVERED = 'covered';

/** A region of free floor has no name: it is numbered. */
export const nameOf = (room: PlanRoom, number: number): string => room.name || t('Region {n}', { n: number + 1 });

export function roomFigures(rooms: readonly PlanRoom[], patches: PatchFigures): RoomFigures[] {
  const { roomOfPatch, timesSeen, areasM2, reasonOfPatch, reasons, seenFrom } = patches;
  const [scannableM2, seenM2] = [new Float64Array(rooms.length), new Float64Array(rooms.length)];
  const [unseen, hidden] = [0, 1].map(() => rooms.map(() => new Map<string, number>()));
  for (let patch = 0; patch < roomOfPatch.length; patch++) {
    const [room, times, areaM2] = [roomOfPatch[patch], timesSeen[patch], areasM2[patch]];
    if (room >= rooms.length || times === NOT_ASKED) continue;
    const isScannable = times !== NOT_ACHIEVABLE;
    const isSeen = isScannable && times >= seenFrom;
    if (isScannable) scannableM2[room] += areaM2;
    if (isSeen) seenM2[room] += areaM2;
    else if (reasonOfPatch !== null) {
      const planned = reasons[reasonOfPatch[patch]];
      const reason = planned === COVERED ? LEFT_BY_EDITS : planned;
      const areaOf = (isScannable ? unseen : hidden)[room];
      if (reason !== undefined && reason !== INSIDE_SOLIDS) areaOf.set(reason, (areaOf.get(reason) ?? 0) + areaM2);
    }
  }
  return rooms.map((room, number) => ({
    number,
    name: nameOf(room, number),
    room,
    scannableM2: scannableM2[number],
    seenM2: seenM2[number],
    coverage: scannableM2[number] > 0 ? seenM2[number] / scannableM2[number] : null,
    unseen: largestOf(unseen[number]),
    hidden: largestOf(hidden[number]),
  }));
}

function largestOf(areas: ReadonlyMap<string, number>): ReasonArea | null {
  const [largest] = [...areas].sort(([, a], [, b]) => b - a);
  return largest === undefined ? null : { reason: largest[0], areaM2: largest[1] };
}

/** Least covered first; rooms of which nothing is scannable before all. */
export const worstFirst = (rooms: readonly RoomFigures[]): RoomFigures[] =>
  [...rooms].sort((a, b) => (a.coverage ?? -1) - (b.coverage ?? -1) || b.scannableM2 - a.scannableM2);

// ------------------------------------------------------------------------------------------------ colours
export const ROOM_COVERAGE = 'rooms';
/** Below what is required by up to these, in shares of the scannable area. */
const STEPS = [0.05, 0.15] as const;
const [IN_NO_ROOM, NONE_SCANNABLE] = [4, 5];

/** Of the requirement in the field's words: at or above it, and how far below. */
export function roomLayer(required: number): ClassLayer {
  const [near, far] = STEPS.map((step) => askedPercent(Math.max(0, required - step)));
  return {
    kind: 'classes',
    id: ROOM_COVERAGE,
    title: t('Coverage by room'),
    classes: [
      { value: 0, label: t('{percent} and more', { percent: askedPercent(required) }), color: '#2b8a9b' },
      { value: 1, label: t('{percent} and more', { percent: near }), color: '#a9d9d3' },
      { value: 2, label: t('{percent} and more', { percent: far }), color: '#f0c36d' },
      { value: 3, label: t('less'), color: '#d1603d' },
      { value: IN_NO_ROOM, label: t('in no room'), color: PALE },
      { value: NONE_SCANNABLE, label: t('not scannable'), color: { light: '#c6cacc', dark: '#6d757a' } },
    ],
  };
}

/** A class of `roomLayer` for each patch. */
export function roomClasses(
  rooms: readonly RoomFigures[],
  roomOfPatch: Uint16Array,
  required: number,
): Uint8Array<ArrayBuffer> {
  const ofRoom = rooms.map(({ coverage }) => {
    if (coverage === null) return NONE_SCANNABLE;
    const step = [0, ...STEPS].findIndex((one) => coverage >= required - one - 1e-9);
    return step < 0 ? 3 : step;
  });
  return Uint8Array.from(roomOfPatch, (room) => ofRoom[room] ?? IN_NO_ROOM);
}
