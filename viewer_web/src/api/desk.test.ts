import { expect, test } from 'vitest';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import { ApiClient } from './client.ts';
import { Desk, UNNAMED } from './desk.ts';
import type { Change, Point } from './documents.ts';
import type { listenToEvents } from './events.ts';

const move = (x: number, station = 'S001'): Change => ({ kind: 'move_station', station, position_m: [x, 0, 1.3] });

async function openDesk(server = new FakeReviewServer()) {
  const heard: { review?: (event: { revision: number; author: string; objects: string[] }) => void } = {};
  const line: { onOpen?: () => void } = {};
  const listen = ((_: string, handlers: typeof heard, options: typeof line) => {
    Object.assign(heard, handlers);
    Object.assign(line, options);
    return () => undefined;
  }) as unknown as typeof listenToEvents;
  const desk = new Desk(new ApiClient(server.fetch), { listen });
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
