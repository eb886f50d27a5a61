/** What is being edited right now and not yet committed: the tool in hand, an outline half drawn, a station under way. */

import { type Signal, signal } from '@preact/signals';
import type { Point, PreviewHead } from '../api/documents.ts';
import type { Picked } from '../scene/state.ts';
import type { DraftStation } from './draft.ts';
import type { DoorState } from './entrance-words.ts';
import type { GroundMap, Place } from './ground-map.ts';
import { Latencies } from './preview-loop.ts';
import type { SurfaceChange } from './what-if.ts';

export type Tool = 'select' | 'add' | 'forbid' | 'keep_out' | 'priority' | 'ground' | 'entrance' | 'doors' | 'comment';

/** Who deals with a comment, and the day by which, as 2026-12-01; empty: nobody, none. */
export interface Assignment {
  readonly assignee: string;
  readonly due: string;
}
export const UNASSIGNED: Assignment = { assignee: '', due: '' };

/** A station on its way: dragged, raised, or about to be added (`stationId` null). Scene frame. */
export interface UnderWay {
  readonly stationId: string | null;
  readonly floorId: string;
  readonly positionM: Point;
  readonly heightM: number;
}

/** A comment that is being written. */
export interface CommentSpot {
  readonly target: string | number | null;
  readonly positionM: Point | null;
  /** What it is pinned to, in words. */
  readonly title: string;
}

/** What panels and keys ask of the editor, see editor.ts. */
export interface EditorActions {
  readonly mover: {
    raise(station: DraftStation, heightM: number): void;
    nudge(station: DraftStation, eastM: number, northM: number): Promise<void>;
    place(station: DraftStation, toM: Point): Promise<void>;
    moveAll(stations: readonly DraftStation[], eastM: number, northM: number): Promise<void>;
    finish(): Promise<unknown>;
    cancel(): void;
  };
  readonly areas: {
    dropOutline(): void;
    finishOutline(): Promise<void>;
    takeCornerBack(): void;
    addStation(picked: Picked): void;
  };
}

export interface Editing {
  /** Null until the building is drawn. */
  readonly editor: Signal<EditorActions | null>;
  readonly tool: Signal<Tool>;
  /** The plan is shown as it was planned, without the review's edits. */
  readonly showsPlan: Signal<boolean>;
  /** On the tab of runs, the best stations of a run that goes on are shown, not the plan's. */
  readonly watchesRun: Signal<boolean>;
  readonly underWay: Signal<UnderWay | null>;
  /** The server's answer about what is under way; null: none yet. */
  readonly preview: Signal<PreviewHead | null>;
  /** What the station under way wins and loses there; null: not known. */
  readonly surfaceChange: Signal<SurfaceChange | null>;
  /** Corners drawn so far, scene frame. */
  readonly outline: Signal<readonly Place[]>;
  readonly outlineFloor: Signal<string | null>;
  readonly zoneName: Signal<string>;
  readonly priorityPercent: Signal<string>;
  readonly forbidRadiusM: Signal<number>;
  readonly marksGround: Signal<boolean>;
  /** What a clicked door is marked as. */
  readonly doorState: Signal<DoorState>;
  /** Of the floor that is shown; null: not known (yet). */
  readonly ground: Signal<GroundMap | null>;
  readonly commentSpot: Signal<CommentSpot | null>;
  /** The comment that is being typed: it stays where the tab is changed. */
  readonly commentText: Signal<string>;
  /** Whom it is for. */
  readonly commentAssignment: Signal<Assignment>;
  /** What it shows, as it will be sent; null: no photo. */
  readonly commentPhoto: Signal<Blob | null>;
  /** From the movement of the pointer until the server's answer was there, and until it was drawn. */
  readonly answerTimes: Latencies;
  readonly drawTimes: Latencies;
  /** Counts drags: the times are written down when one ends. */
  readonly nDrags: Signal<number>;
}

export function createEditing(): Editing {
  return {
    editor: signal<EditorActions | null>(null),
    tool: signal<Tool>('select'),
    showsPlan: signal(false),
    watchesRun: signal(true),
    underWay: signal<UnderWay | null>(null),
    preview: signal<PreviewHead | null>(null),
    surfaceChange: signal<SurfaceChange | null>(null),
    outline: signal<readonly Place[]>([]),
    outlineFloor: signal<string | null>(null),
    zoneName: signal(''),
    priorityPercent: signal('98'),
    forbidRadiusM: signal(0.5),
    marksGround: signal(true),
    doorState: signal<DoorState>('open'),
    ground: signal<GroundMap | null>(null),
    commentSpot: signal<CommentSpot | null>(null),
    commentText: signal(''),
    commentAssignment: signal(UNASSIGNED),
    commentPhoto: signal<Blob | null>(null),
    answerTimes: new Latencies(),
    drawTimes: new Latencies(),
    nDrags: signal(0),
  };
}
