import { afterEach, beforeEach, expect, test, vi } from 'vitest';
import { Pointer, type PointerConsumer } from './pointer.ts';

let canvas: EventTarget;
let clicks: [number, number][];
let holds: boolean[];
let pointer: Pointer;
beforeEach(() => {
  vi.stubGlobal('window', new EventTarget());
  canvas = new EventTarget();
  clicks = [];
  holds = [];
  pointer = new Pointer(
    canvas as HTMLCanvasElement,
    (x, y) => clicks.push([x, y]),
    (isTaken) => holds.push(isTaken),
  );
});
afterEach(() => vi.unstubAllGlobals());

interface At {
  readonly x: number;
  readonly y?: number;
  readonly more?: Partial<PointerEvent>;
}

function send(type: string, { x, y = 0, more = {} }: At, to: EventTarget = canvas): PointerEvent {
  const event = Object.assign(new Event(type), { clientX: x, clientY: y, isPrimary: true, button: 0, buttons: 0 });
  const whole = Object.assign(event, { pointerId: 1, ...more }) as unknown as PointerEvent;
  to.dispatchEvent(whole);
  return whole;
}
/** Released: the browser lets the event rise to the window, with the canvas as its target. */
function release(x: number, y = 0): void {
  const event = new Event('pointerup');
  Object.defineProperty(event, 'target', { value: canvas });
  window.dispatchEvent(Object.assign(event, { clientX: x, clientY: y, pointerId: 1 }));
}

const taker = (said: string[], name = ''): PointerConsumer => ({
  onDown: ({ clientX }) => {
    said.push(`${name}down ${clientX}`);
    return clientX < 100;
  },
  onMove: ({ clientX }) => said.push(`${name}move ${clientX}`),
  onUp: ({ clientX }, isClick) => said.push(`${name}up ${clientX} ${isClick}`),
  onCancel: () => said.push(`${name}cancel`),
});

test('a press nobody takes is a click where it hardly moves, and the camera’s where it moves', () => {
  send('pointerdown', { x: 10 });
  release(12);
  send('pointerdown', { x: 10 });
  send('pointermove', { x: 50 }, window);
  release(50);
  expect(clicks).toEqual([[12, 0]]);
  expect(holds).toEqual([]);
});

test('a drag that is taken is told in full, and the camera held meanwhile', () => {
  const said: string[] = [];
  pointer.add(taker(said));
  send('pointerdown', { x: 10 });
  send('pointermove', { x: 12 }, window);
  send('pointermove', { x: 40 }, window);
  send('pointermove', { x: 70, more: { pointerId: 2 } }, window);
  release(60);
  expect(said).toEqual(['down 10', 'move 40', 'up 60 false']);
  expect(holds).toEqual([true, false]);
  expect(clicks).toEqual([]);
});

test('a press is offered to the latest consumer first, and to the next where it does not take it', () => {
  const said: string[] = [];
  pointer.add(taker(said, 'first '));
  const remove = pointer.add(taker(said, 'second '));
  send('pointerdown', { x: 150 });
  release(150);
  expect(said).toEqual(['second down 150', 'first down 150']);
  expect(clicks).toEqual([[150, 0]]);
  remove();
  send('pointerdown', { x: 20 });
  release(20);
  expect(said.slice(2)).toEqual(['first down 20', 'first up 20 true']);
});

test('a drag the browser takes away is cancelled, once', () => {
  const said: string[] = [];
  pointer.add(taker(said));
  send('pointerdown', { x: 10 });
  send('pointercancel', { x: 10 }, window);
  release(10);
  expect(said).toEqual(['down 10', 'cancel']);
  expect(holds).toEqual([true, false]);
});

test('a consumer may want a click, or only look on', () => {
  const hovered: number[] = [];
  pointer.add({ onHover: ({ clientX }) => hovered.push(clientX), onClick: ({ clientX }) => clientX > 5 });
  send('pointermove', { x: 3 });
  send('pointermove', { x: 4, more: { buttons: 1 } });
  send('pointerdown', { x: 10 });
  release(10);
  send('pointerdown', { x: 1 });
  release(1);
  expect(hovered).toEqual([3]);
  expect(clicks).toEqual([[1, 0]]);
});

test('second fingers and other buttons press nothing', () => {
  const said: string[] = [];
  pointer.add(taker(said));
  send('pointerdown', { x: 10, more: { isPrimary: false } });
  send('pointerdown', { x: 10, more: { button: 2 } });
  expect(said).toEqual([]);
});

test('after it is gone it hears nothing', () => {
  pointer.dispose();
  send('pointerdown', { x: 10 });
  release(10);
  expect(clicks).toEqual([]);
});

test('what is held beside itself is dragged beside the pointer', () => {
  const said: string[] = [];
  pointer.add(taker(said));
  pointer.down(send('pointerdown', { x: 300 }, new EventTarget()), 'S001', { x: 250, y: 0 });
  send('pointermove', { x: 320 }, window);
  release(340);
  expect(said).toEqual(['down 50', 'move 70', 'up 90 false']);
});
