import { expect, test } from 'vitest';
import { movedCursor } from './moved-cursor.ts';

test('arrows move the cursor, further while they are held, and not out of the picture', () => {
  const at = { x: 100, y: 50 };
  expect(movedCursor(at, 'ArrowUp', false, 200, 100)).toEqual({ x: 100, y: 46 });
  expect(movedCursor(at, 'ArrowRight', true, 200, 100)).toEqual({ x: 116, y: 50 });
  expect(movedCursor({ x: 2, y: 98 }, 'ArrowLeft', true, 200, 100)).toEqual({ x: 1, y: 98 });
  expect(movedCursor({ x: 2, y: 98 }, 'ArrowDown', true, 200, 100)).toEqual({ x: 2, y: 99 });
  expect(movedCursor(at, 'w', false, 200, 100)).toBeNull();
});
