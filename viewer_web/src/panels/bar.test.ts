import { expect, test } from 'vitest';
import { closeOnEscape, listenToEscape } from './escape.ts';
import { rovedTo } from './roving.ts';

test('left and right go round a bar, Home and End to its ends, and other keys nowhere', () => {
  expect(['ArrowRight', 'ArrowLeft', 'Home', 'End', 'ArrowDown', 'Enter'].map((key) => rovedTo(key, 0, 3))).toEqual([
    1,
    2,
    0,
    2,
    null,
    null,
  ]);
  expect(rovedTo('ArrowRight', 2, 3)).toBe(0);
});

test('Escape closes what was opened last, and only that; with nothing open it is for others', () => {
  const target = new EventTarget();
  const stop = listenToEscape(target as unknown as Window);
  const closed: string[] = [];
  target.addEventListener('keydown', () => closed.push('others'));
  const press = (key = 'Escape') => void target.dispatchEvent(Object.assign(new Event('keydown'), { key }));
  const layers = ['menu', 'list'].map((name) => {
    const off = closeOnEscape(() => {
      closed.push(name);
      off();
    });
    return off;
  });
  expect(layers).toHaveLength(2);
  for (let i = 0; i < 3; i++) press();
  expect(closed).toEqual(['list', 'menu', 'others']);
  stop();
});
