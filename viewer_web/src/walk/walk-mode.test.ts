import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import type { Pointer, PointerConsumer } from '../scene/pointer.ts';
import { createStore, type Store } from '../store.ts';
import { WalkMode } from './walk-mode.ts';

let frames: ((now: number) => void)[];
let store: Store;
let placed: (readonly number[])[];
let held: boolean[];
let consumers: PointerConsumer[];
let picks: number;
let nLeft: number;
let walk: WalkMode;
beforeEach(() => {
  frames = [];
  for (const name of ['HTMLInputElement', 'HTMLSelectElement']) vi.stubGlobal(name, class extends EventTarget {});
  vi.stubGlobal('window', new EventTarget());
  vi.stubGlobal('requestAnimationFrame', (frame: (now: number) => void) => frames.push(frame));
  store = createStore();
  [placed, held, consumers, picks, nLeft] = [[], [], [], 0, 0];
  const pointer = {
    add: (consumer: PointerConsumer) => {
      consumers.push(consumer);
      return () => consumers.splice(consumers.indexOf(consumer), 1);
    },
  } as unknown as Pointer;
  walk = new WalkMode(store, {
    world: {
      groundBelow: (_x, _y, z, depthM) => (z >= 0 && z <= depthM ? 0 : null),
      floorBelow: (x) => (x < 50 ? { heightM: 0, floorId: 'F0' } : null),
      freeAhead: () => 99,
    },
    pointer,
    groundAt: (x) => (x > 100 ? [7, 8, 0] : null),
    place: (pose) => placed.push(pose),
    holdCamera: (isHeld) => held.push(isHeld),
    pick: () => picks++,
    left: () => nLeft++,
  });
});
afterEach(() => vi.unstubAllGlobals());

function key(type: 'keydown' | 'keyup', name: string): boolean {
  const event = Object.assign(new Event(type, { cancelable: true }), { key: name });
  return !window.dispatchEvent(event);
}
/** Let pictures pass, a twentieth of a second each. */
function pass(n: number): void {
  for (let i = 0; i < n; i++) {
    const due = frames.splice(0);
    for (const frame of due) frame(1000 + 50 * i);
  }
}
const last = (): readonly number[] => placed[placed.length - 1];

test('keys walk while they are held, and no pictures are asked for after', () => {
  walk.enter([0, 0, 1.65], 0);
  expect(store.isWalking.value).toBe(true);
  expect(key('keydown', 'w')).toBe(true);
  pass(10);
  expect(last()[0]).toBeGreaterThan(0.5);
  expect(last()[2]).toBeCloseTo(1.65);
  key('keyup', 'w');
  pass(2);
  expect(frames).toHaveLength(0);
  const at = last()[0];
  key('keydown', 'ArrowLeft');
  pass(10);
  expect(last()[0]).toBe(at);
  expect(last()[4]).toBeGreaterThan(last()[1]);
});

test('the camera’s place is that of the eye, and stands in the store', () => {
  walk.enter([1, 2, 1.4], Math.PI / 2, 1.4);
  expect(last().map((x) => +x.toFixed(6))).toEqual([1, 2, 1.4, 1, 3, 1.4]);
  expect(store.camera.value).toEqual(last());
  walk.eyeHeightM = 2;
  expect(last()[2]).toBeCloseTo(2);
  expect(walk.eyeHeightM).toBe(2);
});

test('Escape leaves, other keys are the page’s, and after that all are', () => {
  walk.enter([0, 0, 1.65], 0);
  expect(key('keydown', 'x')).toBe(false);
  expect(key('keydown', 'Escape')).toBe(true);
  expect([store.isWalking.value, nLeft, held.at(-1), consumers.length]).toEqual([false, 1, false, 0]);
  expect(key('keydown', 'w')).toBe(false);
  walk.leave();
  expect(nLeft).toBe(1);
});

test('a drag looks around, a click on ground goes there, a click on a wall tells what it is', () => {
  walk.enter([0, 0, 1.65], 0);
  const [consumer] = consumers;
  const place = (clientX: number) => ({ clientX, clientY: 0, stationId: null, event: {} as PointerEvent });
  expect(consumer.onDown?.(place(10))).toBe(true);
  consumer.onMove?.(place(110));
  expect(last()[4]).toBeGreaterThan(0.3);
  expect(last().slice(0, 3)).toEqual([0, 0, 1.65]);
  consumer.onUp?.(place(200), true);
  expect(last().slice(0, 2)).toEqual([7, 8]);
  consumer.onUp?.(place(50), true);
  expect(picks).toBe(1);
  expect(consumer.onDown?.({ ...place(10), stationId: 'S001' })).toBe(false);
});

test('a place of the map is gone to, looking the same way, and one where nobody stands is not', () => {
  walk.enter([0, 0, 1.65], 1);
  expect(walk.goOnMap(3, 4, 0)).toBe(true);
  expect(last().slice(0, 3)).toEqual([3, 4, 1.65]);
  expect(walk.where.value?.headingRad).toBe(1);
  expect(walk.floorBelow(walk.where.value!)).toBe('F0');
  expect(walk.goOnMap(60, 4, 0)).toBe(false);
  expect(last().slice(0, 2)).toEqual([3, 4]);
  walk.end();
  expect(walk.where.value).toBeNull();
});

test('a walk begins from a camera, at its height above the ground and looking its way', () => {
  walk.enterAt([3, 4, 1.2, 3, 5, 1.2]);
  expect(walk.eyeHeightM).toBeCloseTo(1.2);
  expect(last().map((x) => +x.toFixed(6))).toEqual([3, 4, 1.2, 3, 5, 1.2]);
});
