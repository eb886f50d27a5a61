import { afterEach, beforeEach, expect, test } from 'vitest';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { chooseCharacterKeys, hasCharacterKeys, restoreCharacterKeys } from './character-keys.ts';
import { listenToKeys } from './keys.ts';

let done: string[];
let press: (key: string) => void;
const kept = new Map<string, string>();
const storage = {
  getItem: (key: string) => kept.get(key) ?? null,
  setItem: (key: string, value: string) => void kept.set(key, value),
};

// Node has no elements: nothing here comes from a field.
const none = class {};
beforeEach(() => {
  Object.assign(globalThis, { HTMLInputElement: none, HTMLTextAreaElement: none, HTMLSelectElement: none });
  done = [];
  const say =
    (what: string) =>
    (...more: unknown[]): void =>
      void done.push([what, ...more].join(' '));
  const store = {
    loaded: { value: { stage: { floors: [{ id: 'F0' }] } } },
    isWalking: { peek: () => false },
    ...{ chooseFloor: say('floor'), stepFloor: say('step'), clear: say('clear') },
  } as unknown as Store;
  const view = { showAll: say('show'), orbit: say('orbit') } as unknown as PlanView;
  const target = new EventTarget();
  listenToKeys(target as Window, store, view);
  press = (key) => void target.dispatchEvent(Object.assign(new Event('keydown'), { key }));
});
afterEach(() => {
  kept.clear();
  hasCharacterKeys.value = true;
});

const KEYS = ['h', '1', '+', 'ArrowUp', 'Escape'];

test('keys of one character do nothing where they are switched off, and others do', () => {
  for (const key of KEYS) press(key);
  expect(done).toEqual(['show side', 'floor F0', 'orbit 0 0 0.8', 'step 1', 'clear']);
  done.length = 0;
  chooseCharacterKeys(storage, false);
  for (const key of KEYS) press(key);
  expect(done).toEqual(['step 1', 'clear']);
});

test('the browser keeps the choice', () => {
  restoreCharacterKeys(storage);
  expect(hasCharacterKeys.value).toBe(true);
  chooseCharacterKeys(storage, false);
  hasCharacterKeys.value = true;
  restoreCharacterKeys(storage);
  expect(hasCharacterKeys.value).toBe(false);
  chooseCharacterKeys(storage, true);
  restoreCharacterKeys(storage);
  expect(hasCharacterKeys.value).toBe(true);
});
