import { expect, test, vi } from 'vitest';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { ApiClient } from './client.ts';
import type { Change, LiveState, Point, Run } from './documents.ts';
import type { listenToEvents } from './events.ts';
import { ReviewClient, UNNAMED } from './review-client.ts';
import { UndoMemory } from './undo-memory.ts';

const move = (x: number, station = 'S001'): Change => ({ kind: 'move_station', station, position_m: [x, 0, 1.3] });

interface Heard {
  live?: (state: LiveState) => void;
  run?: (run: Run) => void;
  review?: (event: { revision: number; author: string; objects: string[] }) => void;
  run_deleted?: (event: { id: string }) => void;
}

async function openReviewClient(server = new FakeReviewServer(), undoMemory: UndoMemory | null = null) {
  const heard: Heard = {};
  const line: { onOpen?: () => void; onBreak?: () => void } = {};
  const listen = ((_: string, handlers: typeof heard, options: typeof line) => {
    Object.assign(heard, handlers);
    Object.assign(line, options);
    return () => undefined;
  }) as unknown as typeof listenToEvents;
  const reviewClient = new ReviewClient(new ApiClient(server.fetch), { listen, undoMemory });
  await reviewClient.open();
  reviewClient.setAuthor('Ada');
  const placeOf = (id = 'S001'): Point | null | undefined => reviewClient.review.value?.stations[id]?.position_m;
  return { server, reviewClient, heard, line, placeOf };
}

test('changes are taken back and made again in the order they were made', async () => {
  const { reviewClient, placeOf } = await openReviewClient();
  for (const x of [1, 2, 3]) await reviewClient.commit(`to ${x}`, [move(x)]);
  expect(reviewClient.undoable.value).toBe('to 3');
  await reviewClient.undo();
  await reviewClient.undo();
  expect(placeOf()).toEqual([1, 0, 1.3]);
  expect([reviewClient.undoable.value, reviewClient.redoable.value]).toEqual(['to 1', 'to 2']);
  await reviewClient.redo();
  expect(placeOf()).toEqual([2, 0, 1.3]);
  await reviewClient.undo();
  await reviewClient.undo();
  expect(placeOf()).toBeNull();
  expect(await reviewClient.undo()).toBe(false);
});

test('a new change ends what could be made again', async () => {
  const { reviewClient } = await openReviewClient();
  await reviewClient.commit('first', [move(1)]);
  await reviewClient.undo();
  await reviewClient.commit('second', [move(2)]);
  expect(reviewClient.redoable.value).toBeNull();
  expect(reviewClient.undoable.value).toBe('second');
});

test('changes that are sent at once are made one after another', async () => {
  const { reviewClient, server, placeOf } = await openReviewClient();
  await Promise.all([1, 2, 3].map((x) => reviewClient.commit(`to ${x}`, [move(x)])));
  expect(server.review.revision).toBe(3);
  expect(placeOf()).toEqual([3, 0, 1.3]);
  expect(reviewClient.conflict.value).toBeNull();
});

test('a conflict says who changed what, and stops further changes until it is settled', async () => {
  const { reviewClient, server, placeOf } = await openReviewClient();
  server.changeAs('Grace', move(7));
  expect(await reviewClient.commit('mine', [move(1)])).toBe(false);
  expect(reviewClient.conflict.value?.words).toMatch(/Grace changed station S001/);
  expect(placeOf()).toEqual([7, 0, 1.3]);
  expect(await reviewClient.commit('another', [move(4, 'S002')])).toBe(false);
  reviewClient.takeTheirs();
  expect(await reviewClient.commit('another', [move(4, 'S002')])).toBe(true);
  expect(placeOf()).toEqual([7, 0, 1.3]);
});

test('after a conflict the own change can be made all the same', async () => {
  const { reviewClient, server, placeOf } = await openReviewClient();
  server.changeAs('Grace', move(7));
  await reviewClient.commit('mine', [move(1)]);
  expect(await reviewClient.applyMine()).toBe(true);
  expect(placeOf()).toEqual([1, 0, 1.3]);
  await reviewClient.undo();
  expect(placeOf()).toEqual([7, 0, 1.3]);
});

test('what was done here since something was looked at is no conflict; what others did is', async () => {
  const { reviewClient, server, placeOf } = await openReviewClient();
  const revision = server.review.revision;
  void reviewClient.commit('first', [move(1)]);
  await reviewClient.settled();
  expect(reviewClient.withOwnSince(revision)).toBe(revision + 1);
  const since = reviewClient.withOwnSince(revision);
  expect(await reviewClient.commit('a drag that began before', [move(2)], since)).toBe(true);
  expect(placeOf()).toEqual([2, 0, 1.3]);
  server.changeAs('Ben', move(5));
  await reviewClient.commit('another', [move(3, 'S002')]);
  expect(reviewClient.withOwnSince(revision)).toBe(revision + 2);
  expect(await reviewClient.commit('again', [move(4)], reviewClient.withOwnSince(revision))).toBe(false);
  expect(reviewClient.conflict.value?.words).toMatch(/^Ben changed station S001/);
});

test('what was decided elsewhere, as on a phone, meets what was done here since', async () => {
  const { reviewClient, server } = await openReviewClient();
  const { revision } = server.review;
  expect(await reviewClient.commit('taken in', [move(1)], revision)).toBe(true);
  expect(await reviewClient.commit('taken in again', [move(1)], revision)).toBe(false);
  expect(reviewClient.conflict.value).not.toBeNull();
});

test('changes of different objects are no conflict', async () => {
  const { reviewClient, server, placeOf } = await openReviewClient();
  server.changeAs('Grace', move(7, 'S002'));
  expect(await reviewClient.commit('mine', [move(1)])).toBe(true);
  expect([placeOf('S001'), placeOf('S002')]).toEqual([
    [1, 0, 1.3],
    [7, 0, 1.3],
  ]);
});

test("what others change is fetched when it is told, and one's own is not fetched again", async () => {
  const { reviewClient, server, heard, placeOf } = await openReviewClient();
  server.changeAs('Grace', move(7));
  heard.review?.({ revision: 1, author: 'Grace', objects: ['station:S001'] });
  await reviewClient.commit('mine', [move(2, 'S002')]);
  expect(placeOf()).toEqual([7, 0, 1.3]);
  const nAsked = server.asked.length;
  heard.review?.({ revision: 2, author: 'Ada', objects: ['station:S002'] });
  await reviewClient.commit('again', [move(3, 'S002')]);
  expect(server.asked.slice(nAsked)).toEqual(['POST api/review/changes']);
  expect(reviewClient.activities.value.map(({ author }) => author)).toEqual(['Grace', 'Ada']);
});

test('what happened before the line was there is asked for once it is', async () => {
  const { server, reviewClient, line, placeOf } = await openReviewClient();
  server.changeAs('Grace', move(7));
  server.live = { state: 'ready', step: null, fraction: null, message: null };
  expect(reviewClient.live.value.state).not.toBe('ready');
  line.onOpen?.();
  await reviewClient.commit('in turn', [move(2, 'S002')]);
  expect(reviewClient.live.value.state).toBe('ready');
  expect(placeOf()).toEqual([7, 0, 1.3]);
});

test('a server that is gone is told of, and nothing is taken for done', async () => {
  const { reviewClient, server } = await openReviewClient();
  server.isGone = true;
  expect(await reviewClient.commit('mine', [move(1)])).toBe(false);
  expect(reviewClient.notice.value?.text).toMatch(/does not answer/);
  expect(reviewClient.undoable.value).toBeNull();
  server.isGone = false;
  expect(await reviewClient.commit('mine', [move(1)])).toBe(true);
  expect(reviewClient.notice.value).toBeNull();
});

test('a server that only sends files has no reviewClient', async () => {
  const reviewClient = new ReviewClient(new ApiClient(async () => new Response('not found', { status: 404 })));
  await reviewClient.open();
  expect([reviewClient.line.value, reviewClient.canEdit.value, reviewClient.notice.value]).toEqual([
    'none',
    false,
    null,
  ]);
});

test('whoever gives no name is unnamed', async () => {
  const { reviewClient, server } = await openReviewClient();
  reviewClient.setAuthor('  ');
  await reviewClient.commit('mine', [move(1)]);
  expect(server.review.touched['station:S001'].by).toBe(UNNAMED);
});

test('a review that can not be read is told in the words of the server, and the page goes on once it can', async () => {
  const server = new FakeReviewServer();
  server.refusal = { status: 503, message: 'plan/review.usda: the review is damaged' };
  const { reviewClient, heard, line } = await openReviewClient(server);
  line.onOpen?.();
  await expect.poll(() => reviewClient.line.value).toBe('open');
  expect([reviewClient.fault.value, reviewClient.canEdit.value]).toEqual([
    'plan/review.usda: the review is damaged',
    false,
  ]);
  server.refusal = null;
  heard.review?.({ revision: 0, author: 'another program', objects: [] });
  await expect.poll(() => reviewClient.canEdit.value).toBe(true);
  expect(reviewClient.fault.value).toBeNull();
});

test('a server that was started again is told from one that does not answer', async () => {
  const { reviewClient, server, line } = await openReviewClient();
  line.onOpen?.();
  server.isGone = true;
  line.onBreak?.();
  await expect.poll(() => reviewClient.line.value).toBe('broken');
  server.isGone = false;
  server.refusal = { status: 401, message: 'no token' };
  line.onBreak?.();
  await expect.poll(() => reviewClient.line.value).toBe('refused');
  server.refusal = null;
  line.onOpen?.();
  expect(reviewClient.line.value).toBe('open');
  expect(await reviewClient.commit('mine', [move(1)])).toBe(true);
  expect(reviewClient.fault.value).toBeNull();
});

test('another plan in place of the one that is shown is told, and not taken for it', async () => {
  const { reviewClient, server, line } = await openReviewClient();
  const shown = reviewClient.session.value;
  server.planSha256 = '1'.repeat(64);
  line.onOpen?.();
  await expect.poll(() => reviewClient.fault.value).toMatch(/replaced.*Reload/);
  expect(reviewClient.session.value).toBe(shown);
});

test('what is in the way of a run is known, and runs that are deleted are gone', async () => {
  const { reviewClient, server, heard, line } = await openReviewClient();
  server.runs = { runs: [{ id: 'R001' }, { id: 'R002' }], obstacle: 'house.ifc is not found' };
  await reviewClient.refreshRuns();
  expect(reviewClient.runObstacle.value).toBe('house.ifc is not found');
  heard.run_deleted?.({ id: 'R001' });
  expect(reviewClient.runs.value.map(({ id }) => id)).toEqual(['R002']);
  server.runs = { runs: [], obstacle: null };
  line.onOpen?.(); // what happened while the line was broken was told to nobody
  await expect.poll(() => [reviewClient.runs.value.length, reviewClient.runObstacle.value]).toEqual([0, null]);
});

test('a run that is deleted while the runs are asked for does not come back with the answer', async () => {
  const { reviewClient, server, heard } = await openReviewClient();
  server.runs = { runs: [{ id: 'R001' }, { id: 'R002' }], obstacle: null };
  const asked = reviewClient.refreshRuns(); // answered with both, and not yet heard
  server.runs = { runs: [{ id: 'R002' }], obstacle: null };
  heard.run_deleted?.({ id: 'R001' });
  await asked;
  expect(reviewClient.runs.value.map(({ id }) => id)).toEqual(['R002']);
});

test('runs that tell more often than the server answers are shown, and hold up nothing', async () => {
  const { reviewClient, server, heard, line, placeOf } = await openReviewClient();
  await reviewClient.refreshRuns();
  server.runs = { runs: [{ id: 'R001' }, { id: 'R002' }], obstacle: null };
  const run = { id: 'R001', state: 'running' } as Run;
  server.onAsked = (what) => {
    if (what === 'GET api/runs') heard.run?.({ ...run, title: `told ${server.asked.length} questions in` });
  };
  line.onOpen?.();
  expect(await reviewClient.commit('mine', [move(1)])).toBe(true);
  expect(placeOf()).toEqual([1, 0, 1.3]);
  expect(reviewClient.runs.value.map(({ id, title }) => [id, title?.slice(0, 4)])).toEqual([
    ['R001', 'told'],
    ['R002', undefined],
  ]);
});

test('a live side that gets ready while the session is asked for stays ready', async () => {
  const { reviewClient, server, heard, line } = await openReviewClient();
  server.live = { state: 'starting', step: 'loading the scene', fraction: 0.9, message: null };
  server.onAsked = (what) => {
    // After the answer that says that it starts.
    if (what === 'GET api/review') heard.live?.({ state: 'ready', step: null, fraction: null, message: null });
  };
  line.onOpen?.();
  await reviewClient.commit('in turn', [move(2)]);
  expect(reviewClient.live.value.state).toBe('ready');
});

class FakeStorage {
  private readonly texts = new Map<string, string>();
  getItem(key: string): string | null {
    return this.texts.get(key) ?? null;
  }
  setItem(key: string, text: string): void {
    this.texts.set(key, text);
  }
}

test('what was done can be undone on another page of the tab, as of the same review of the same plan', async () => {
  const storage = new FakeStorage();
  const { server, reviewClient } = await openReviewClient(undefined, new UndoMemory(storage));
  for (const x of [1, 2, 3]) await reviewClient.commit(`to ${x}`, [move(x)]);
  await reviewClient.undo();
  const later = await openReviewClient(server, new UndoMemory(storage));
  expect([later.reviewClient.undoable.value, later.reviewClient.redoable.value]).toEqual(['to 2', 'to 3']);
  await later.reviewClient.undo();
  expect(later.placeOf()).toEqual([1, 0, 1.3]);
  await later.reviewClient.redo();
  await later.reviewClient.redo();
  expect(later.placeOf()).toEqual([3, 0, 1.3]);

  const anew = await openReviewClient(new FakeReviewServer(), new UndoMemory(storage));
  expect(anew.reviewClient.undoable.value).toBeNull();
  server.planSha256 = '1'.repeat(64);
  const other = await openReviewClient(server, new UndoMemory(storage));
  expect(other.reviewClient.undoable.value).toBeNull();
  server.planSha256 = '0'.repeat(64);
  expect((await openReviewClient(server)).reviewClient.undoable.value).toBeNull();
});

test('more steps than a tab keeps are kept from the last on', () => {
  const memory = new UndoMemory(new FakeStorage());
  const steps = (n: number, text = '') =>
    Array.from({ length: n }, (_, i) => ({ label: `${i}`, changes: [{ kind: 'add_comment', text } as Change] }));
  memory.keep('plan', 3, { done: steps(300), undone: [] });
  const kept = memory.recall('plan', 3);
  expect([kept?.done.length, kept?.done.at(-1)?.label]).toEqual([200, '299']);
  memory.keep('plan', 4, { done: steps(150, 'x'.repeat(10_000)), undone: [] });
  expect(memory.recall('plan', 4)?.done.map(({ label }) => label)).toEqual(
    steps(150)
      .slice(75)
      .map(({ label }) => label),
  );
  memory.keep('plan', 5, { done: steps(1, 'x'.repeat(2_000_000)), undone: [] });
  expect(memory.recall('plan', 5)).toMatchObject({ revision: 5, done: [] });
});

test('the others are listed, and the own name is told once it is typed', async () => {
  vi.useFakeTimers();
  try {
    const addresses: string[] = [];
    const heard: { people?: (event: { names: readonly string[] }) => void } = {};
    let nStopped = 0;
    const listen = ((address: string, handlers: typeof heard) => {
      addresses.push(address);
      Object.assign(heard, handlers);
      return () => nStopped++;
    }) as unknown as typeof listenToEvents;
    const reviewClient = new ReviewClient(new ApiClient(new FakeReviewServer().fetch), { listen });
    reviewClient.setAuthor('A');
    await reviewClient.open();
    for (const name of ['Ad', 'Ada', 'Ada \u202eL']) reviewClient.setAuthor(name);
    vi.runAllTimers();
    expect(addresses).toEqual(['api/events?name=A', 'api/events?name=Ada%20L']);
    expect(nStopped).toBe(1);
    heard.people?.({ names: ['Ada L', 'Grace'] });
    expect(reviewClient.others.value).toEqual(['Grace']);
    reviewClient.close();
    expect(nStopped).toBe(2);
  } finally {
    vi.useRealTimers();
  }
});
