import { expect, test } from 'vitest';
import { ApiClient } from '../api/client.ts';
import type { LiveState } from '../api/documents.ts';
import { ReviewClient } from '../api/review-client.ts';
import { createStore, type Store } from '../store.ts';
import { FakeReviewServer } from '../testing/fake-review-server.ts';
import {
  canComment,
  canEdit,
  isLive,
  toolInHand,
  whyNoComments,
  whyNoEditing,
  whyNoServer,
  whyNotLive,
} from './readiness.ts';

async function storeOn(server: FakeReviewServer | null): Promise<Store> {
  const fetcher = server?.fetch ?? (async () => new Response('not found', { status: 404 }));
  const reviewClient = new ReviewClient(new ApiClient(fetcher), { listen: () => () => undefined });
  await reviewClient.open();
  return createStore({ reviewClient });
}
const live = (changes: Partial<LiveState>): LiveState => ({
  state: 'ready',
  step: null,
  fraction: null,
  message: null,
  ...changes,
});

test('a server that takes changes refuses nothing', async () => {
  const store = await storeOn(new FakeReviewServer());
  expect([canEdit(store), whyNoEditing(store)]).toEqual([true, null]);
});

test('without a server, with a file server, and read-only, it is said how to get one that takes changes', async () => {
  expect(whyNoEditing(createStore({ isStatic: true }))).toMatch(/read-only copy.*tlsplan view/);
  expect(whyNoEditing(await storeOn(null))).toMatch(/only shows files.*tlsplan view/);
  const store = await storeOn(new FakeReviewServer());
  const session = store.reviewClient!.session;
  session.value = { ...session.value!, read_only: true };
  expect(whyNoEditing(store)).toMatch(/--read-only.*without/);
  expect(canEdit(store)).toBe(false);
});

test('who may only comment has the tool for that alone, and is told why there are no others', async () => {
  const store = await storeOn(new FakeReviewServer());
  const session = store.reviewClient!.session;
  session.value = { ...session.value!, comment_only: true };
  expect([canComment(store), whyNoComments(store), canEdit(store)]).toEqual([true, null, false]);
  expect(whyNoEditing(store)).toMatch(/comments and verdicts.*other address/);
  store.editing.tool.value = 'comment';
  store.tab.value = 'review';
  expect(toolInHand(store)).toBe('comment');
  store.tab.value = 'edit';
  expect(toolInHand(store)).toBeNull();
});

test('a server whose review can not be read is not taken for one that is gone', async () => {
  const server = new FakeReviewServer();
  server.refusal = { status: 503, message: 'plan/review.usda: the review is damaged; rename it' };
  const store = await storeOn(server);
  expect([whyNoServer(store.reviewClient!), whyNoEditing(store)]).toEqual([
    server.refusal.message,
    server.refusal.message,
  ]);
  server.isGone = true;
  expect(whyNoEditing(await storeOn(server))).toMatch(/does not answer/);
});

test('the plan of a run is not edited', async () => {
  const store = await storeOn(new FakeReviewServer());
  store.planBase.value = 'runs/R001/plan';
  expect(canEdit(store)).toBe(false);
  expect(whyNoEditing(store)).toMatch(/plan of a run/);
});

test('while the live side is not ready, it is said how far it is or how to have it', async () => {
  const store = await storeOn(new FakeReviewServer());
  const state = store.reviewClient!.live;
  state.value = live({ state: 'starting', step: 'loading house.ifc', fraction: 0.4 });
  expect(whyNotLive(store)).toMatch(/loading house\.ifc, 40 %/);
  state.value = live({ state: 'failed', message: 'house.ifc: not found. Pass --scene.' });
  expect(whyNotLive(store)).toMatch(/not found\. Pass --scene\. To move stations, fix this/);
  state.value = live({ state: 'off' });
  expect(whyNotLive(store)).toMatch(/--scene building\.ifc/);
  expect(isLive(store)).toBe(false);
  state.value = live({});
  expect([whyNotLive(store), isLive(store)]).toEqual([null, true]);
});

test('tools work on their own tab only: elsewhere a drag or a click changes nothing', async () => {
  const store = await storeOn(new FakeReviewServer());
  const inHand = (tab: Store['tab']['value'], tool: Store['editing']['tool']['value']) => {
    store.tab.value = tab;
    store.editing.tool.value = tool;
    return toolInHand(store);
  };
  expect(inHand('plan', 'keep_out')).toBeNull();
  expect(inHand('plan', 'select')).toBeNull();
  expect(inHand('edit', 'keep_out')).toBe('keep_out');
  expect(inHand('edit', 'comment')).toBe('select');
  expect(inHand('review', 'comment')).toBe('comment');
  expect(inHand('review', 'add')).toBeNull();
  store.planBase.value = 'runs/R001/plan';
  expect(inHand('edit', 'select')).toBeNull();
});
