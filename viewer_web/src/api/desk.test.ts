import { expect, test } from 'vitest';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { ApiClient } from './client.ts';
import { Desk, UNNAMED } from './desk.ts';
import type { Change, LiveState, Point, Run } from './documents.ts';
import type { listenToEvents } from './events.ts';
import { UndoMemory } from './undo-memory.ts';

const move = (x: number, station = 'S001'): Change => ({ kind: 'move_station', station, position_m: [x, 0, 1.3] });

interface Heard {
  live?: (state: LiveState) => void;
  run?: (run: Run) => void;
  review?: (event: { revision: number; author: string; objects: string[] }) => void;
  run_deleted?: (event: { id: string }) => void;
}

async function openDesk(server = new FakeReviewServer(), undoMemory: UndoMemory | null = null) {
  const heard: Heard = {};
  const line: { onOpen?: () => void; onBreak?: () => void } = {};
  const listen = ((_: string, handlers: typeof heard, options: typeof line) => {
    Object.assign(heard, handlers);
    Object.assign(line, options);
    return () => undefined;
  }) as unknown as typeof listenToEvents;
  const desk = new Desk(new ApiClient(server.fetch), { listen, undoMemory });
  await desk.open();
  desk.setAuthor('Ada');
  const placeOf = (id = 'S001'): Point | null | undefined => desk.review.value?.stations[id]?.position_m;
  return { server, desk, heard, line, placeOf };
}

test('changes are taken back and made again in the order they were made', async () => {
  const { desk, placeOf } = await openDesk();
  for (const x of [1, 2, 3]) await desk.commit(`to ${x}`, [move(x)]);
  expect(desk.undoable.value).toBe('to 3');
  await desk.undo();
  await desk.undo();
  expect(placeOf()).toEqual([1, 0, 1.3]);
  expect([desk.undoable.value, desk.redoable.value]).toEqual(['to 1', 'to 2']);
  await desk.redo();
  expect(placeOf()).toEqual([2, 0, 1.3]);
  await desk.undo();
  await desk.undo();
  expect(placeOf()).toBeNull();
  expect(await desk.undo()).toBe(false);
});

test('a new change ends what could be made again', async () => {
  const { desk } = await openDesk();
  await desk.commit('first', [move(1)]);
  await desk.undo();
  await desk.commit('second', [move(2)]);
  expect(desk.redoable.value).toBeNull();
  expect(desk.undoable.value).toBe('second');
});

test('changes that are sent at once are made one after another', async () => {
  const { desk, server, placeOf } = await openDesk();
  await Promise.all([1, 2, 3].map((x) => desk.commit(`to ${x}`, [move(x)])));
  expect(server.review.revision).toBe(3);
  expect(placeOf()).toEqual([3, 0, 1.3]);
  expect(desk.conflict.value).toBeNull();
});

test('a conflict says who changed what, and stops further changes until it is settled', async () => {
  const { desk, server, placeOf } = await openDesk();
  server.changeAs('Grace', move(7));
  expect(await desk.commit('mine', [move(1)])).toBe(false);
  expect(desk.conflict.value?.words).toMatch(/Grace changed station S001/);
  expect(placeOf()).toEqual([7, 0, 1.3]);
  expect(await desk.commit('another', [move(4, 'S002')])).toBe(false);
  desk.takeTheirs();
  expect(await desk.commit('another', [move(4, 'S002')])).toBe(true);
  expect(placeOf()).toEqual([7, 0, 1.3]);
});

test('after a conflict the own change can be made all the same', async () => {
  const { desk, server, placeOf } = await openDesk();
  server.changeAs('Grace', move(7));
  await desk.commit('mine', [move(1)]);
  expect(await desk.applyMine()).toBe(true);
  expect(placeOf()).toEqual([1, 0, 1.3]);
  await desk.undo();
  expect(placeOf()).toEqual([7, 0, 1.3]);
});

test('changes of different objects are no conflict', async () => {
  const { desk, server, placeOf } = await openDesk();
  server.changeAs('Grace', move(7, 'S002'));
  expect(await desk.commit('mine', [move(1)])).toBe(true);
  expect([placeOf('S001'), placeOf('S002')]).toEqual([
    [1, 0, 1.3],
    [7, 0, 1.3],
  ]);
});

test("what others change is fetched when it is told, and one's own is not fetched again", async () => {
  const { desk, server, heard, placeOf } = await openDesk();
  server.changeAs('Grace', move(7));
  heard.review?.({ revision: 1, author: 'Grace', objects: ['station:S001'] });
  await desk.commit('mine', [move(2, 'S002')]);
  expect(placeOf()).toEqual([7, 0, 1.3]);
  const nAsked = server.asked.length;
  heard.review?.({ revision: 2, author: 'Ada', objects: ['station:S002'] });
  await desk.commit('again', [move(3, 'S002')]);
  expect(server.asked.slice(nAsked)).toEqual(['POST api/review/changes']);
  expect(desk.activities.value.map(({ author }) => author)).toEqual(['Grace', 'Ada']);
});

test('what happened before the line was there is asked for once it is', async () => {
  const { server, desk, line, placeOf } = await openDesk();
  server.changeAs('Grace', move(7));
  server.live = { state: 'ready', step: null, fraction: null, message: null };
  expect(desk.live.value.state).not.toBe('ready');
  line.onOpen?.();
  await desk.commit('in turn', [move(2, 'S002')]);
  expect(desk.live.value.state).toBe('ready');
  expect(placeOf()).toEqual([7, 0, 1.3]);
});

test('a server that is gone is told of, and nothing is taken for done', async () => {
  const { desk, server } = await openDesk();
  server.isGone = true;
  expect(await desk.commit('mine', [move(1)])).toBe(false);
  expect(desk.notice.value?.text).toMatch(/does not answer/);
  expect(desk.undoable.value).toBeNull();
  server.isGone = false;
  expect(await desk.commit('mine', [move(1)])).toBe(true);
  expect(desk.notice.value).toBeNull();
});

test('a server that only sends files has no desk', async () => {
  const desk = new Desk(new ApiClient(async () => new Response('not found', { status: 404 })));
  await desk.open();
  expect([desk.line.value, desk.canEdit.value, desk.notice.value]).toEqual(['none', false, null]);
});

test('whoever gives no name is unnamed', async () => {
  const { desk, server } = await openDesk();
  desk.setAuthor('  ');
  await desk.commit('mine', [move(1)]);
  expect(server.review.touched['station:S001'].by).toBe(UNNAMED);
});

test('a review that can not be read is told in the words of the server, and the page goes on once it can', async () => {
  const server = new FakeReviewServer();
  server.refusal = { status: 503, message: 'plan/review.usda: the review is damaged' };
  const { desk, heard, line } = await openDesk(server);
  line.onOpen?.();
  await expect.poll(() => desk.line.value).toBe('open');
  expect([desk.fault.value, desk.canEdit.value]).toEqual(['plan/review.usda: the review is damaged', false]);
  server.refusal = null;
  heard.review?.({ revision: 0, author: 'another program', objects: [] });
  await expect.poll(() => desk.canEdit.value).toBe(true);
  expect(desk.fault.value).toBeNull();
});

test('a server that was started again is told from one that does not answer', async () => {
  const { desk, server, line } = await openDesk();
  line.onOpen?.();
  server.isGone = true;
  line.onBreak?.();
  await expect.poll(() => desk.line.value).toBe('broken');
  server.isGone = false;
  server.refusal = { status: 401, message: 'no token' };
  line.onBreak?.();
  await expect.poll(() => desk.line.value).toBe('refused');
  server.refusal = null;
  line.onOpen?.();
  expect(desk.line.value).toBe('open');
  expect(await desk.commit('mine', [move(1)])).toBe(true);
  expect(desk.fault.value).toBeNull();
});

test('another plan in place of the one that is shown is told, and not taken for it', async () => {
  const { desk, server, line } = await openDesk();
  const shown = desk.session.value;
  server.planSha256 = '1'.repeat(64);
  line.onOpen?.();
  await expect.poll(() => desk.fault.value).toMatch(/replaced.*Reload/);
  expect(desk.session.value).toBe(shown);
});

test('what is in the way of a run is known, and runs that are deleted are gone', async () => {
  const { desk, server, heard, line } = await openDesk();
  server.runs = { runs: [{ id: 'R001' }, { id: 'R002' }], obstacle: 'house.ifc is not found' };
  await desk.refreshRuns();
  expect(desk.runObstacle.value).toBe('house.ifc is not found');
  heard.run_deleted?.({ id: 'R001' });
  expect(desk.runs.value.map(({ id }) => id)).toEqual(['R002']);
  server.runs = { runs: [], obstacle: null };
  line.onOpen?.(); // what happened while the line was broken was told to nobody
  await expect.poll(() => [desk.runs.value.length, desk.runObstacle.value]).toEqual([0, null]);
});

test('a run that is deleted while the runs are asked for does not come back with the answer', async () => {
  const { desk, server, heard } = await openDesk();
  server.runs = { runs: [{ id: 'R001' }, { id: 'R002' }], obstacle: null };
  const asked = desk.refreshRuns(); // answered with both, and not yet heard
  server.runs = { runs: [{ id: 'R002' }], obstacle: null };
  heard.run_deleted?.({ id: 'R001' });
  await asked;
  expect(desk.runs.value.map(({ id }) => id)).toEqual(['R002']);
});

test('runs that tell more often than the server answers are shown, and hold up nothing', async () => {
  const { desk, server, heard, line, placeOf } = await openDesk();
  await desk.refreshRuns();
  server.runs = { runs: [{ id: 'R001' }, { id: 'R002' }], obstacle: null };
  const run = { id: 'R001', state: 'running' } as Run;
  server.onAsked = (what) => {
    if (what === 'GET api/runs') heard.run?.({ ...run, title: `told ${server.asked.length} questions in` });
  };
  line.onOpen?.();
  expect(await desk.commit('mine', [move(1)])).toBe(true);
  expect(placeOf()).toEqual([1, 0, 1.3]);
  expect(desk.runs.value.map(({ id, title }) => [id, title?.slice(0, 4)])).toEqual([
    ['R001', 'told'],
    ['R002', undefined],
  ]);
});

test('a live side that gets ready while the session is asked for stays ready', async () => {
  const { desk, server, heard, line } = await openDesk();
  server.live = { state: 'starting', step: 'loading the scene', fraction: 0.9, message: null };
  server.onAsked = (what) => {
    // After the answer that says that it starts.
    if (what === 'GET api/review') heard.live?.({ state: 'ready', step: null, fraction: null, message: null });
  };
  line.onOpen?.();
  await desk.commit('in turn', [move(2)]);
  expect(desk.live.value.state).toBe('ready');
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
  const { server, desk } = await openDesk(undefined, new UndoMemory(storage));
  for (const x of [1, 2, 3]) await desk.commit(`to ${x}`, [move(x)]);
  await desk.undo();
  const later = await openDesk(server, new UndoMemory(storage));
  expect([later.desk.undoable.value, later.desk.redoable.value]).toEqual(['to 2', 'to 3']);
  await later.desk.undo();
  expect(later.placeOf()).toEqual([1, 0, 1.3]);
  await later.desk.redo();
  await later.desk.redo();
  expect(later.placeOf()).toEqual([3, 0, 1.3]);

  const anew = await openDesk(new FakeReviewServer(), new UndoMemory(storage));
  expect(anew.desk.undoable.value).toBeNull();
  server.planSha256 = '1'.repeat(64);
  const other = await openDesk(server, new UndoMemory(storage));
  expect(other.desk.undoable.value).toBeNull();
  server.planSha256 = '0'.repeat(64);
  expect((await openDesk(server)).desk.undoable.value).toBeNull();
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
