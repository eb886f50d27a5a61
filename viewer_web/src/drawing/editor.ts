/**
 * The drawing that is being corrected: its steps, and how it is saved. Every step is sent as a whole, one after another; where
 * another page saved meanwhile nothing is sent until the user has chosen between theirs and their own.
 */
import { batch, computed, type ReadonlySignal, type Signal, signal } from '@preact/signals';
import { ApiError } from '../api/api-error.ts';
import type { ApiClient } from '../api/client.ts';
import type { DrawingAnswer, Drawn, DrawnLinesAnswer } from '../api/documents.ts';
import type { Chosen } from './edits.ts';
import type { Corner } from './geometry.ts';
import { SegmentIndex } from './snap.ts';

export type Tool = 'select' | 'wall' | 'door' | 'window' | 'scale' | 'north';
/** `saved`: the disk has it; `refused`: the server does not take it, and says why; `conflict`: another page was first. */
export type Saving = 'saved' | 'saving' | 'refused' | 'failed' | 'conflict';

/** All that is drawn of a storey, as recognised: corners in metres, line by line. */
export interface DrawnLines {
  readonly lines: readonly (readonly Corner[])[];
  /** x0, y0, x1, y1 of the picture that they were traced in; null: there is none. */
  readonly pictureM: readonly [number, number, number, number] | null;
  readonly index: SegmentIndex;
}

const MOST_STEPS = 500;
const PAUSE_MS = 300;

export class DrawingEditor {
  /** Null: not there, or not known yet. */
  readonly drawn: Signal<Drawn | null> = signal(null);
  readonly rooms: Signal<DrawingAnswer['rooms']> = signal([]);
  /** This page may save corrections. */
  readonly mayChange: Signal<boolean> = signal(false);
  /** Name of the drawing file. */
  readonly file: Signal<string> = signal('');
  /** There is a plan of it already; true too while nothing is known. */
  readonly hasPlan: Signal<boolean> = signal(true);
  readonly lines: Signal<ReadonlyMap<number, DrawnLines>> = signal(new Map());
  /** The storey that is shown, from 0. */
  readonly storey: Signal<number> = signal(0);
  readonly tool: Signal<Tool> = signal('select');
  readonly chosen: Signal<Chosen | null> = signal(null);
  /** Points that were clicked of a wall, a length, or north. */
  readonly begun: Signal<readonly Corner[]> = signal([]);
  /** What is dragged, as it would be; null: nothing is. */
  readonly dragged: Signal<Drawn | null> = signal(null);
  readonly saving: Signal<Saving> = signal('saved');
  /** What the server, or an edit, has against it; null: nothing. */
  readonly message: Signal<string | null> = signal(null);
  readonly shown: ReadonlySignal<Drawn | null> = computed(() => this.dragged.value ?? this.drawn.value);
  readonly canUndo: ReadonlySignal<boolean> = computed(() => this.past.value.length > 0);
  readonly canRedo: ReadonlySignal<boolean> = computed(() => this.future.value.length > 0);
  private readonly past: Signal<readonly Drawn[]> = signal([]);
  private readonly future: Signal<readonly Drawn[]> = signal([]);
  private revision = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private sending: Promise<void> = Promise.resolve();

  constructor(
    private readonly client: Pick<ApiClient, 'json' | 'post'>,
    private readonly pauseMs = PAUSE_MS,
  ) {}

  /** Ask for the drawing as it is on disk; steps that were made here are forgotten. */
  async open(): Promise<void> {
    try {
      const answer = await this.client.json<DrawingAnswer>('drawing');
      batch(() => {
        this.drawn.value = answer.drawing;
        this.rooms.value = answer.rooms;
        this.mayChange.value = answer.may_correct;
        this.file.value = answer.file;
        this.hasPlan.value = answer.has_plan || answer.drawing === null;
        this.revision = answer.drawing?.revision ?? 0;
        this.past.value = [];
        this.future.value = [];
        this.chosen.value = null;
        this.saving.value = 'saved';
        this.message.value = null;
      });
    } catch (error) {
      if ((error as ApiError).status !== 404) this.message.value = (error as Error).message;
    }
  }

  async loadLines(storey: number): Promise<void> {
    if (this.lines.peek().has(storey)) return;
    try {
      const { lines, picture } = await this.client.json<DrawnLinesAnswer>(`drawing/lines/${storey}`);
      this.lines.value = new Map([...this.lines.peek(), [storey, linesOf(lines, picture)]]);
    } catch (error) {
      this.message.value = (error as Error).message;
    }
  }

  /** Make a step. */
  change(to: Drawn): void {
    const from = this.drawn.peek();
    if (from === null || to === from) return;
    batch(() => {
      this.past.value = [...this.past.peek().slice(1 - MOST_STEPS), from];
      this.future.value = [];
      this.show(to);
    });
  }

  undo(): void {
    this.step(this.past, this.future);
  }

  redo(): void {
    this.step(this.future, this.past);
  }

  /** After a conflict: what the other page saved. */
  takeTheirs(): Promise<void> {
    return this.open();
  }

  /** After a conflict: this page's, over what the other one saved. */
  async keepMine(): Promise<void> {
    try {
      const { drawing } = await this.client.json<DrawingAnswer>('drawing');
      this.revision = drawing?.revision ?? 0;
      this.saving.value = 'saving';
      await this.save();
    } catch (error) {
      this.message.value = (error as Error).message;
    }
  }

  /** All steps until now have been answered; whether they are saved. */
  async settled(): Promise<boolean> {
    if (this.timer !== null || this.saving.peek() === 'failed') await this.save();
    await this.sending;
    return this.saving.peek() === 'saved';
  }

  private step(from: Signal<readonly Drawn[]>, to: Signal<readonly Drawn[]>): void {
    const [next, now] = [from.peek().at(-1), this.drawn.peek()];
    if (next === undefined || now === null) return;
    batch(() => {
      from.value = from.peek().slice(0, -1);
      to.value = [...to.peek(), now];
      this.show(next);
    });
  }

  private show(drawn: Drawn): void {
    this.drawn.value = drawn;
    this.dragged.value = null;
    this.begun.value = [];
    if (this.saving.peek() === 'conflict') return;
    this.message.value = null;
    this.saving.value = 'saving';
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.save(), this.pauseMs);
  }

  private save(): Promise<void> {
    if (this.timer !== null) clearTimeout(this.timer);
    this.timer = null;
    this.sending = this.sending.then(() => this.send());
    return this.sending;
  }

  private async send(): Promise<void> {
    const drawn = this.drawn.peek();
    if (drawn === null || this.saving.peek() === 'conflict') return;
    try {
      const answer = await this.client.post<DrawingAnswer>('drawing', {
        base_revision: this.revision,
        drawing: { ...drawn, revision: this.revision },
      });
      this.revision = answer.drawing?.revision ?? this.revision;
      batch(() => {
        this.rooms.value = answer.rooms;
        // Steps that were made meanwhile are sent next.
        if (this.drawn.peek() === drawn) {
          this.saving.value = 'saved';
          this.message.value = null;
        }
      });
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      const isRefused = error.status >= 400 && error.status < 500;
      this.saving.value = error.status === 409 ? 'conflict' : isRefused ? 'refused' : 'failed';
      this.message.value = error.message;
    }
  }
}

/** Of each line x, y of its corners in turn, millimetres: the first, then steps. */
export function linesOf(steps: DrawnLinesAnswer['lines'], pictureM: DrawnLinesAnswer['picture'] = null): DrawnLines {
  const lines = steps.map((line) => {
    let [x, y] = [0, 0];
    const corners: Corner[] = [];
    for (let i = 0; i + 1 < line.length; i += 2) {
      x += line[i];
      y += line[i + 1];
      corners.push([x / 1000, y / 1000]);
    }
    return corners;
  });
  const segments = lines.flatMap((line) => line.slice(1).map((corner, i) => [line[i], corner] as const));
  return { lines, pictureM, index: new SegmentIndex(segments) };
}
