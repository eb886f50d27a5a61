/** What can be undone and made again, kept in the browser's tab: opening a run's plan is another page, and going back from it too. */
import type { Change } from './documents.ts';

/** What was done, and the changes that take it back (or make it again). */
export interface Step {
  readonly label: string;
  readonly changes: readonly Change[];
}

export interface Steps {
  readonly done: readonly Step[];
  readonly undone: readonly Step[];
}

interface Kept extends Steps {
  readonly planSha256: string;
  readonly revision: number;
}

const KEY = 'tlsplan-undo-1';
/** Of each list: nobody goes back further. */
const MOST_STEPS = 200;
/** Tabs keep about five million; outlines of a thousand corners take tens of thousands. */
const MOST_CHARACTERS = 1_000_000;

export class UndoMemory {
  constructor(private readonly storage: Pick<Storage, 'getItem' | 'setItem'>) {}

  /** The steps of a plan whose review is at `revision` by now; null: none are kept, or they are of another review. */
  recall(planSha256: string, revision: number): Steps | null {
    const text = this.storage.getItem(KEY);
    if (text === null) return null;
    const kept = JSON.parse(text) as Kept;
    // A review that was begun anew counts from zero.
    return kept.planSha256 === planSha256 && kept.revision <= revision ? kept : null;
  }

  keep(planSha256: string, revision: number, steps: Steps): void {
    let done: readonly Step[] = steps.done.slice(-MOST_STEPS);
    let undone: readonly Step[] = steps.undone.slice(-MOST_STEPS);
    const written = (): string => JSON.stringify({ planSha256, revision, done, undone } satisfies Kept);
    let text = written();
    while (text.length > MOST_CHARACTERS) {
      // What is furthest away goes first; a list of one that is too long goes whole.
      [done, undone] = [laterHalf(done), laterHalf(undone)];
      text = written();
    }
    this.storage.setItem(KEY, text);
  }
}

function laterHalf(steps: readonly Step[]): readonly Step[] {
  return steps.slice(Math.ceil(steps.length / 2));
}
