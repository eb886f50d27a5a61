import { expect, test } from 'vitest';
import { listenToEvents, type Source } from './events.ts';

class FakeSource implements Source {
  readonly listeners = new Map<string, (event: { data?: string }) => void>();
  isClosed = false;
  addEventListener(name: string, listener: (event: { data?: string }) => void): void {
    this.listeners.set(name, listener);
  }
  close(): void {
    this.isClosed = true;
  }
  tell(name: string, data?: unknown): void {
    this.listeners.get(name)?.(data === undefined ? {} : { data: JSON.stringify(data) });
  }
}

function listening() {
  const sources: FakeSource[] = [];
  const waits: { ms: number; then: () => void }[] = [];
  const log: string[] = [];
  const stop = listenToEvents(
    'api/events',
    { review: ({ author }) => log.push(author) },
    {
      open: () => {
        sources.push(new FakeSource());
        return sources[sources.length - 1];
      },
      wait: (ms, then) => {
        waits.push({ ms, then });
        return () => waits.splice(0);
      },
      onOpen: () => log.push('open'),
      onBreak: () => log.push('broken'),
    },
  );
  return { sources, waits, log, stop };
}

test('events reach their handlers', () => {
  const { sources, log } = listening();
  sources[0].tell('open');
  sources[0].tell('review', { revision: 1, author: 'Ada', objects: [] });
  sources[0].tell('live', { state: 'ready' });
  expect(log).toEqual(['open', 'Ada']);
});

test('a broken line is tried again, each time later, until it is there', () => {
  const { sources, waits, log } = listening();
  sources[0].tell('open');
  for (let i = 0; i < 8; i++) {
    sources[i].tell('error');
    waits[i].then();
  }
  expect(waits.map(({ ms }) => ms)).toEqual([500, 1000, 2000, 4000, 8000, 15000, 15000, 15000]);
  sources[8].tell('open');
  expect(log.at(-1)).toBe('open');
  sources[8].tell('error');
  expect(waits.at(-1)?.ms).toBe(500);
  expect(sources.map(({ isClosed }) => isClosed)).not.toContain(false);
});

test('whoever stops is not connected again', () => {
  const { sources, waits, stop } = listening();
  sources[0].tell('error');
  stop();
  expect(waits).toEqual([]);
  expect(sources[0].isClosed).toBe(true);
});
