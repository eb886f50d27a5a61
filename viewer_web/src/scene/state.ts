/** The 3D picture: where the camera is, which surface was clicked, light or dark. */
import { type Signal, signal } from '@preact/signals';
import { t } from '../language/language.ts';
import type { StageElement } from '../load/stage.ts';

/** A surface that was clicked. */
export interface Picked {
  readonly element: StageElement;
  readonly elementIndex: number;
  /** Of the merged list. */
  readonly triangle: number;
  readonly patch: number;
  /** The floor whose ground it is; null: not ground. */
  readonly groundOf: string | null;
  /** Stations that see the patch under the pointer; null: not achievable, or not a surface but a cut. */
  readonly timesSeen: number | null;
  /** Whether the plan is of this surface at all. */
  readonly isAsked: boolean;
  /** The floor whose slice it was clicked in; null: the whole building. */
  readonly drawnOn: string | null;
  /** The inside of a body that the cut opens. */
  readonly isSection: boolean;
  /** Scene coordinates, metres. */
  readonly pointM: readonly [number, number, number];
}

export interface SceneState {
  /** The browser draws the building in 3D; where not, its floors stand there in plan. */
  readonly hasPicture: Signal<boolean>;
  /** Where the camera was left by hand: position and target, local metres; null: where the choice of floor puts it. */
  readonly camera: Signal<readonly number[] | null>;
  readonly picked: Signal<Picked | null>;
  /** Drawn straight from above and without perspective, with grid, scale and north. */
  readonly isPlanView: Signal<boolean>;
  /** The page is shown in dark colours. */
  readonly isDark: Signal<boolean>;
}

export function createSceneState(): SceneState {
  return {
    hasPicture: signal(true),
    camera: signal<readonly number[] | null>(null),
    picked: signal<Picked | null>(null),
    isPlanView: signal(false),
    isDark: signal(false),
  };
}

/** Why what is drawn in 3D alone is switched off; null: it is not. */
export function whyNoPicture({ hasPicture }: SceneState): string | null {
  return hasPicture.value ? null : t('Needs the 3D picture, which this browser does not show');
}
