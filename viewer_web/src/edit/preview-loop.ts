/**
 * Asks the server about a station that is being dragged: one question under way, and of those that wait only the newest.
 *
 * Every answer is against the draft as it is committed, so one that is lost or late does no harm.
 */
export class PreviewLoop<Question, Answer> {
  private waiting: { question: Question; askedMs: number } | null = null;
  private abort: AbortController | null = null;
  /** Answers to questions asked before are of no use any more. */
  private generation = 0;

  constructor(
    private readonly ask: (question: Question, signal: AbortSignal) => Promise<Answer>,
    private readonly show: (answer: Answer, askedMs: number) => void,
    private readonly fail: (error: Error) => void,
    private readonly now: () => number = () => performance.now(),
  ) {}

  /** Ask now, or as soon as the question under way is answered. */
  put(question: Question): void {
    this.waiting = { question, askedMs: this.now() };
    if (this.abort === null) void this.run();
  }

  /** Forget what waits and what is under way. */
  stop(): void {
    this.generation++;
    this.waiting = null;
    this.abort?.abort();
    this.abort = null;
  }

  get isBusy(): boolean {
    return this.abort !== null;
  }

  private async run(): Promise<void> {
    const { generation } = this;
    while (this.waiting !== null) {
      const { question, askedMs } = this.waiting;
      this.waiting = null;
      const abort = new AbortController();
      this.abort = abort;
      try {
        const answer = await this.ask(question, abort.signal);
        if (generation !== this.generation) return;
        this.show(answer, askedMs);
      } catch (error) {
        if (generation !== this.generation) return;
        this.fail(error as Error);
      }
    }
    this.abort = null;
  }
}

/** How long updates took, newest last; at most so many are kept. */
export class Latencies {
  readonly ms: number[] = [];
  private static readonly MOST = 2000;

  add(ms: number): void {
    this.ms.push(ms);
    if (this.ms.length > Latencies.MOST) this.ms.shift();
  }

  /** The value that the share `q` of them does not exceed; null where there are none. */
  quantile(q: number): number | null {
    if (this.ms.length === 0) return null;
    const sorted = [...this.ms].sort((a, b) => a - b);
    return sorted[Math.min(sorted.length - 1, Math.max(0, Math.ceil(q * sorted.length) - 1))];
  }
}
