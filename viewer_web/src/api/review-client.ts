/**
 * The review client: what the server knows beyond the plan's files (review, live side), and the one way to change the review.
 *
 * Changes are sent one after another. The server answers each with the changes that take it back, which is all that undoing needs. Where
 * somebody else changed the same object meanwhile, nothing is sent on until the user has chosen between theirs and their own.
 */

import { batch, computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import { t } from '../language/language.ts';
import { ApiError } from './api-error.ts';
import type { ApiClient } from './client.ts';
import { conflictInWords } from './conflict-words.ts';
import type { Change, ConflictAnswer, DraftFigures, LiveState, Review, Run, RunList, Session } from './documents.ts';
import { listenToEvents } from './events.ts';
import type { Step, UndoMemory } from './undo-memory.ts';

/** Whether there is a server at all, whether it answers, and whether it answers us. */
export type Line = 'none' | 'connecting' | 'open' | 'broken' | 'refused';

export interface Notice {
  readonly kind: 'note' | 'warning';
  readonly text: string;
}

/** What is done only after a yes. */
export interface Question {
  readonly title: string;
  readonly text: string;
  /** On the button. */
  readonly yes: string;
  readonly onYes: () => void;
}

export interface PendingConflict {
  readonly changes: readonly Change[];
  readonly label: string;
  readonly words: string;
  readonly answer: ConflictAnswer;
  /** Changes that keep what others did and what was done here; null: one of both has to go. Asked for when they are needed. */
  readonly together: Together;
}

type Together = () => readonly Change[] | null;
const NEVER: Together = () => null;

/** Somebody's change, as it was told while this page was open. */
export interface Activity {
  readonly revision: number;
  readonly author: string;
  readonly objects: readonly string[];
  readonly at: Date;
}

/** What the runs are after it, of what they were before. */
type RunNews = (known: readonly Run[]) => readonly Run[];

type Direction = 'do' | 'undo' | 'redo';

const LIVE_OFF: LiveState = { state: 'off', step: null, fraction: null, message: null };
const MOST_ACTIVITIES = 200;
/** Of typing: a name is not told letter by letter. */
const NAMED_AFTER_MS = 1000;
/** A run may tell more often than a busy server answers. */
const MOST_QUESTIONS_IN_A_ROW = 3;
const AUTHOR_KEY = 'tlsplan-author';
export const UNNAMED = 'Unnamed reviewer';
const REPLACED = t('The plan was replaced by another one since this page was loaded. Reload the page.');

export interface ReviewClientOptions {
  readonly listen?: typeof listenToEvents;
  /** Where the name is kept; null: nowhere. */
  readonly storage?: Pick<Storage, 'getItem' | 'setItem'> | null;
  /** Where steps are kept beyond this page; null: nowhere. */
  readonly undoMemory?: UndoMemory | null;
}

export class ReviewClient {
  readonly line: Signal<Line> = signal('none');
  /** Why the server has no review for this page, in its own words; null: it has. */
  readonly fault: Signal<string | null> = signal(null);
  readonly session: Signal<Session | null> = signal(null);
  readonly live: Signal<LiveState> = signal(LIVE_OFF);
  readonly review: Signal<Review | null> = signal(null);
  readonly figures: Signal<DraftFigures | null> = signal(null);
  readonly runs: Signal<readonly Run[]> = signal([]);
  /** `runs` was asked for. */
  readonly knowsRuns: Signal<boolean> = signal(false);
  /** Why no run can be started; null: nothing is known of. */
  readonly runObstacle: Signal<string | null> = signal(null);
  readonly notice: Signal<Notice | null> = signal(null);
  readonly question: Signal<Question | null> = signal(null);
  readonly conflict: Signal<PendingConflict | null> = signal(null);
  readonly activities: Signal<readonly Activity[]> = signal([]);
  readonly author: Signal<string>;
  /** Who has a page of the plan open. */
  private readonly people: Signal<readonly string[]> = signal([]);
  readonly others: ReadonlySignal<readonly string[]> = computed(() => {
    const own = nameInAddress(this.author.value);
    return this.people.value.filter((name) => name !== own);
  });
  readonly isBusy: Signal<boolean> = signal(false);
  /** Comments and verdicts are taken. */
  readonly canComment: ReadonlySignal<boolean> = computed(
    () => this.session.value !== null && !this.session.value.read_only && this.review.value !== null,
  );
  /** All changes are. */
  readonly canEdit: ReadonlySignal<boolean> = computed(
    () => this.canComment.value && !this.session.value?.comment_only,
  );
  readonly undoable: ReadonlySignal<string | null> = computed(() => this.done.value.at(-1)?.label ?? null);
  readonly redoable: ReadonlySignal<string | null> = computed(() => this.undone.value.at(-1)?.label ?? null);
  private readonly done: Signal<readonly Step[]> = signal([]);
  private readonly undone: Signal<readonly Step[]> = signal([]);
  private nLiveHeard = 0;
  /** What was told of runs while they were asked for, of every question under way. */
  private readonly runNews = new Set<RunNews[]>();
  private queue: Promise<unknown> = Promise.resolve();
  /** Revisions that were made here. */
  private readonly ownRevisions = new Set<number>();
  private stopListening: (() => void) | null = null;
  private naming: ReturnType<typeof setTimeout> | undefined;
  private readonly listen: typeof listenToEvents;
  private readonly storage: ReviewClientOptions['storage'];
  private readonly undoMemory: UndoMemory | null;

  constructor(
    readonly client: ApiClient,
    { listen = listenToEvents, storage = null, undoMemory = null }: ReviewClientOptions = {},
  ) {
    this.undoMemory = undoMemory;
    this.listen = listen;
    this.storage = storage;
    this.author = signal(storage?.getItem(AUTHOR_KEY) ?? '');
  }

  /** Ask for the session and the review, and listen from then on. A server without them is a plain file server. */
  async open(): Promise<void> {
    this.line.value = 'connecting';
    try {
      await this.reload();
      this.line.value = 'open';
    } catch (error) {
      if ((error as ApiError).status === 404) {
        this.line.value = 'none';
        return;
      }
      this.line.value = lineAfter(error);
      this.fault.value = (error as Error).message;
    }
    this.startListening();
  }

  private startListening(): void {
    this.stopListening = this.listen(
      `api/events?name=${encodeURIComponent(nameInAddress(this.author.peek()))}`,
      {
        review: (event) => this.hear(event),
        live: (state) => {
          this.nLiveHeard += 1;
          this.live.value = state;
          if (state.state === 'ready') void this.refreshFigures();
        },
        run: (run) => this.hearOfRuns((known) => [...known.filter(({ id }) => id !== run.id), run]),
        run_deleted: ({ id }) => this.hearOfRuns((known) => known.filter((run) => run.id !== id)),
        people: ({ names }) => {
          this.people.value = names;
        },
      },
      {
        // The first time too: what happened between the session's answer and this line was told to nobody.
        onOpen: () => {
          this.line.value = 'open';
          void this.inTurn(() => this.askAgain());
        },
        onBreak: () => {
          this.people.value = [];
          // A break does not say why: a server that was started again answers, and knows us no longer.
          if (this.line.peek() === 'open') this.line.value = 'broken';
          void this.inTurn(() => this.findOut());
        },
      },
    );
  }

  close(): void {
    clearTimeout(this.naming);
    this.stopListening?.();
  }

  setAuthor(name: string): void {
    this.author.value = name;
    this.storage?.setItem(AUTHOR_KEY, name);
    clearTimeout(this.naming);
    if (this.stopListening === null) return;
    this.naming = setTimeout(() => {
      this.stopListening?.();
      this.startListening();
    }, NAMED_AFTER_MS);
  }

  warn(text: string): void {
    this.notice.value = { kind: 'warning', text };
  }

  /**
   * Change the review; false where that did not happen (the reason is then on the screen). `decidedAt`: the revision that was
   * looked at, where that was some time ago, as when a drag began; whoever changed the same since then is told of. `together`: see
   * `PendingConflict`.
   */
  commit(label: string, changes: readonly Change[], decidedAt?: number, together?: Together): Promise<boolean> {
    return this.inTurn(() => this.send({ label, changes }, 'do', decidedAt, together));
  }

  /** All that was begun until now has been answered. */
  async settled(): Promise<void> {
    await this.queue;
  }

  /** The last revision that differs from an older one by nothing but what was done here: who did it knows of it. */
  withOwnSince(revision: number): number {
    return this.ownRevisions.has(revision + 1) ? this.withOwnSince(revision + 1) : revision;
  }

  undo(): Promise<boolean> {
    return this.inTurn(() => this.sendLast(this.done, 'undo'));
  }

  redo(): Promise<boolean> {
    return this.inTurn(() => this.sendLast(this.undone, 'redo'));
  }

  /** After a conflict: go on with what the others did. */
  takeTheirs(): void {
    this.conflict.value = null;
  }

  /** After a conflict: do it all the same, with what the others did where both can be, else over it. */
  applyMine(): Promise<boolean> {
    const pending = this.conflict.value;
    this.conflict.value = null;
    if (pending === null) return Promise.resolve(false);
    return this.commit(pending.label, pending.together() ?? pending.changes, undefined, pending.together);
  }

  /** The figures of the draft at the revision that is shown; those of an older one are dropped. */
  async refreshFigures(): Promise<void> {
    if (this.live.peek().state !== 'ready') return;
    try {
      const figures = await this.client.json<DraftFigures>('live/figures');
      const shown = this.figures.peek();
      if (shown === null || figures.revision >= shown.revision) this.figures.value = figures;
    } catch (error) {
      this.warn((error as Error).message);
    }
  }

  /** An answer that was overtaken by what was told meanwhile is older than that: the news go over it, and it is asked for again. */
  async refreshRuns(): Promise<void> {
    const news: RunNews[] = [];
    this.runNews.add(news);
    try {
      for (let n = 0; n < MOST_QUESTIONS_IN_A_ROW; n++) {
        news.length = 0;
        const { runs, obstacle } = await this.client.json<RunList>('runs');
        batch(() => {
          this.runs.value = news.reduce<readonly Run[]>((known, tell) => tell(known), runs);
          this.knowsRuns.value = true;
          this.runObstacle.value = obstacle;
        });
        if (news.length === 0) return;
      }
    } finally {
      this.runNews.delete(news);
    }
  }

  private async reload(): Promise<void> {
    const nLiveBefore = this.nLiveHeard;
    const session = await this.client.session();
    const known = this.session.peek();
    if (known !== null && known.plan_sha256 !== session.plan_sha256) {
      this.fault.value = REPLACED;
      return;
    }
    const review = await this.client.review();
    batch(() => {
      this.fault.value = null;
      this.session.value = session;
      // What was told meanwhile is newer than the answer.
      if (this.nLiveHeard === nLiveBefore) this.live.value = session.live;
      this.review.value = review;
      if (known === null) this.recallSteps(session, review);
    });
    void this.refreshFigures();
    if (this.knowsRuns.peek()) await this.refreshRuns();
  }

  private recallSteps({ plan_sha256 }: Session, { revision }: Review): void {
    const steps = this.undoMemory?.recall(plan_sha256, revision) ?? null;
    this.done.value = steps?.done ?? [];
    this.undone.value = steps?.undone ?? [];
  }

  /** Why the line broke. */
  private async findOut(): Promise<boolean> {
    try {
      await this.client.session();
    } catch (error) {
      if (this.line.peek() !== 'open') this.line.value = lineAfter(error);
    }
    return false;
  }

  private async askAgain(): Promise<boolean> {
    try {
      await this.reload();
      return true;
    } catch (error) {
      // Where nothing was there before, nothing else says why.
      if (this.session.peek() === null) this.fault.value = (error as Error).message;
      else this.warn((error as Error).message);
      return false;
    }
  }

  private inTurn(act: () => Promise<boolean>): Promise<boolean> {
    const turn = this.queue.then(act);
    this.queue = turn.catch(() => undefined);
    return turn;
  }

  private sendLast(steps: Signal<readonly Step[]>, direction: Direction): Promise<boolean> {
    const step = steps.peek().at(-1);
    return step === undefined ? Promise.resolve(false) : this.send(step, direction);
  }

  private async send(
    step: Step,
    direction: Direction,
    decidedAt?: number,
    together: Together = NEVER,
  ): Promise<boolean> {
    const review = this.review.peek();
    if (review === null || this.conflict.peek() !== null) return false;
    this.isBusy.value = true;
    try {
      const basis = { revision: decidedAt ?? review.revision, planSha256: this.session.peek()?.plan_sha256 ?? null };
      const outcome = await this.client.commit(basis, this.author.peek().trim() || UNNAMED, step.changes);
      if (outcome.kind === 'conflict') this.meet(step, outcome.answer, together);
      else this.take(step, outcome.answer.review, outcome.answer.undo, direction);
      return outcome.kind === 'committed';
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.warn(error.message);
      return false;
    } finally {
      this.isBusy.value = false;
    }
  }

  private meet(step: Step, answer: ConflictAnswer, together: Together): void {
    batch(() => {
      this.review.value = answer.review;
      this.conflict.value = { ...step, words: conflictInWords(answer), answer, together };
    });
    void this.refreshFigures();
  }

  private take(step: Step, review: Review, undo: readonly Change[], direction: Direction): void {
    const back: Step = { label: step.label, changes: undo };
    this.ownRevisions.add(review.revision);
    batch(() => {
      this.review.value = review;
      this.notice.value = null;
      if (direction === 'undo') {
        this.done.value = this.done.peek().slice(0, -1);
        this.undone.value = [...this.undone.peek(), back];
      } else {
        this.done.value = [...this.done.peek(), back];
        this.undone.value = direction === 'redo' ? this.undone.peek().slice(0, -1) : [];
      }
    });
    this.keepSteps(review.revision);
    void this.refreshFigures();
  }

  private keepSteps(revision: number): void {
    const session = this.session.peek();
    if (session === null) return;
    this.undoMemory?.keep(session.plan_sha256, revision, { done: this.done.peek(), undone: this.undone.peek() });
  }

  private hear(event: { revision: number; author: string; objects: readonly string[] }): void {
    const isNews = event.revision > (this.review.peek()?.revision ?? -1);
    const activity = { ...event, at: new Date() };
    this.activities.value = [...this.activities.peek(), activity].slice(-MOST_ACTIVITIES);
    // After what is being sent: its answer brings the newest review anyway.
    if (isNews) void this.inTurn(() => this.catchUp(event.revision));
  }

  private async catchUp(revision: number): Promise<boolean> {
    if (this.session.peek() === null) return this.askAgain();
    if ((this.review.peek()?.revision ?? -1) >= revision) return false;
    try {
      this.review.value = await this.client.review();
      void this.refreshFigures();
      return true;
    } catch (error) {
      this.warn((error as Error).message);
      return false;
    }
  }

  private hearOfRuns(tell: RunNews): void {
    const inOrder: RunNews = (known) => [...tell(known)].sort((a, b) => a.id.localeCompare(b.id));
    for (const news of this.runNews) news.push(inOrder);
    this.runs.value = inOrder(this.runs.peek());
  }
}

/** Without what the server takes for no name, such as signs that turn the direction of writing: pages without a name are let in. */
function nameInAddress(author: string): string {
  return author.replace(/[\p{C}\p{Zl}\p{Zp}]/gu, '').trim();
}

function lineAfter(error: unknown): Line {
  return error instanceof ApiError && error.status === 401 ? 'refused' : 'broken';
}
