/** What is measured: the tool in hand, the points taken so far, and what stays on the picture until it is removed. */
import { type Signal, signal } from '@preact/signals';
import type { PointM } from './geometry.ts';
import type { WallDistance } from './set-up.ts';

export type MeasureKind = 'distance' | 'height' | 'angle' | 'area';
/** `section`: a line drawn on the plan to cut the building along; `surface`: what a surface is, and who sees it. */
export type SiteTool = MeasureKind | 'section' | 'surface';

export interface MeasurePoint {
  /** Scene frame, metres. */
  readonly sceneM: PointM;
  readonly floorId: string;
  readonly on: 'corner' | 'edge' | 'surface' | 'station';
}

export interface Measurement {
  readonly id: number;
  readonly kind: MeasureKind;
  readonly points: readonly MeasurePoint[];
  /** Taken in the plan view: what counts is what it is in plan. */
  readonly isInPlan: boolean;
}

/** What panels, markers and keys ask of what measures, see measurer.ts. */
export interface MeasureActions {
  take(tool: SiteTool | null): void;
  addStation(stationId: string): void;
  takeBack(): void;
  finish(): void;
}

export interface Measuring {
  /** Null until the building is drawn. */
  readonly measurer: Signal<MeasureActions | null>;
  /** Which panel is open over the canvas. */
  readonly panel: Signal<'measure' | 'section' | null>;
  readonly tool: Signal<SiteTool | null>;
  readonly points: Signal<readonly MeasurePoint[]>;
  /** Where the next point would be. */
  readonly next: Signal<MeasurePoint | null>;
  readonly done: Signal<readonly Measurement[]>;
  /** Of the crosshair that keys move, in CSS pixels on the canvas; null: the pointer is used. */
  readonly cursor: Signal<{ readonly x: number; readonly y: number } | null>;
  /** The walls around the chosen station, and how far they are. */
  readonly showsSetUp: Signal<boolean>;
  readonly walls: Signal<readonly WallDistance[]>;
}

export interface MeasureState {
  readonly measuring: Measuring;
}

export const POINTS_OF: Readonly<Record<SiteTool, number>> = {
  distance: 2,
  height: 2,
  angle: 3,
  area: Number.POSITIVE_INFINITY,
  section: 2,
  surface: 1,
};

export function createMeasureState(): MeasureState {
  return {
    measuring: {
      measurer: signal<MeasureActions | null>(null),
      panel: signal<'measure' | 'section' | null>(null),
      tool: signal<SiteTool | null>(null),
      points: signal<readonly MeasurePoint[]>([]),
      next: signal<MeasurePoint | null>(null),
      done: signal<readonly Measurement[]>([]),
      cursor: signal<{ readonly x: number; readonly y: number } | null>(null),
      showsSetUp: signal(false),
      walls: signal<readonly WallDistance[]>([]),
    },
  };
}
