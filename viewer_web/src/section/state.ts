/** What of the building a section takes away: outside a box, or in front of a line drawn on the plan. */
import { computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import { type CutPlane, planeOfLine, planesOfBox, type SectionBox, type SectionLine } from './planes.ts';

export interface SectionState {
  /** Local frame, metres; null: there is none. */
  readonly sectionBox: Signal<SectionBox | null>;
  readonly sectionLine: Signal<SectionLine | null>;
  /** The section along the line is looked at squarely and without perspective. */
  readonly isFacing: Signal<boolean>;
  /** What was shown before a section, which is of the whole building; null: there is no section. */
  readonly shownBefore: Signal<{ readonly floorId: string | null; readonly isSpread: boolean } | null>;
  readonly cutPlanes: ReadonlySignal<readonly CutPlane[]>;
}

export function createSectionState(): SectionState {
  const sectionBox = signal<SectionBox | null>(null);
  const sectionLine = signal<SectionLine | null>(null);
  return {
    sectionBox,
    sectionLine,
    isFacing: signal(false),
    shownBefore: signal<{ readonly floorId: string | null; readonly isSpread: boolean } | null>(null),
    cutPlanes: computed(() => [
      ...(sectionBox.value === null ? [] : planesOfBox(sectionBox.value)),
      ...(sectionLine.value === null ? [] : [planeOfLine(sectionLine.value)]),
    ]),
  };
}
