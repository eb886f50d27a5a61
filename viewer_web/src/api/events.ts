/** What the server tells by itself: changes of the review, the state of the live side, runs, who is there. Asks again when the line breaks. */

export interface Events {
  readonly review: { readonly revision: number; readonly author: string; readonly objects: readonly string[] };
  readonly live: import('./documents.ts').LiveState;
  readonly run: import('./documents.ts').Run;
  readonly run_deleted: { readonly id: string };
  /** Who has a page of the plan open; those without a name are not among them. */
  readonly people: { readonly names: readonly string[] };
}

type Handlers = { readonly [Name in keyof Events]?: (event: Events[Name]) => void };

/** As much of EventSource as is used, so that tests can stand in for it. */
export interface Source {
  addEventListener(name: string, listener: (event: { data?: string }) => void): void;
  close(): void;
}

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 15_000;

interface ListenOptions {
  /** Called when the line is there, again after every break: what happened before was not told. */
  readonly onOpen?: () => void;
  readonly onBreak?: () => void;
  readonly open?: (address: string) => Source;
  readonly wait?: (ms: number, then: () => void) => () => void;
}

/** Returns what stops listening. */
export function listenToEvents(
  address: string,
  handlers: Handlers,
  {
    onOpen = () => undefined,
    onBreak = () => undefined,
    open = (at) => new EventSource(at) as unknown as Source,
    wait = later,
  }: ListenOptions = {},
): () => void {
  let source: Source | null = null;
  let waitMs = FIRST_WAIT_MS;
  let stopWaiting: () => void = () => undefined;
  const connect = (): void => {
    const opened = open(address);
    source = opened;
    opened.addEventListener('open', () => {
      onOpen();
      waitMs = FIRST_WAIT_MS;
    });
    for (const [name, handler] of Object.entries(handlers)) {
      opened.addEventListener(name, ({ data }) => {
        if (data !== undefined) (handler as (event: unknown) => void)(JSON.parse(data));
      });
    }
    // EventSource comes back by itself after some breaks and not after others: closing makes it the same after all.
    opened.addEventListener('error', () => {
      opened.close();
      onBreak();
      stopWaiting = wait(waitMs, connect);
      waitMs = Math.min(LONGEST_WAIT_MS, 2 * waitMs);
    });
  };
  connect();
  return () => {
    stopWaiting();
    source?.close();
  };
}

function later(ms: number, then: () => void): () => void {
  const timer = setTimeout(then, ms);
  return () => clearTimeout(timer);
}
