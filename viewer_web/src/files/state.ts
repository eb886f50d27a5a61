/** Which files of a scene of several are switched off. */
import { type Signal, signal } from '@preact/signals';
import type { Stage } from '../load/stage.ts';

export interface FileState {
  /** Numbers of the files of which nothing is drawn. */
  readonly hiddenFiles: Signal<ReadonlySet<number>>;
}

export const createFileState = (): FileState => ({ hiddenFiles: signal<ReadonlySet<number>>(new Set()) });

/** Whether a triangle is of a file that is switched off. */
export const hiddenTriangles =
  ({ hiddenFiles }: FileState, { triangles, elements }: Pick<Stage, 'triangles' | 'elements'>) =>
  (triangle: number): boolean =>
    hiddenFiles.peek().has(elements[triangles.element[triangle]].file);
