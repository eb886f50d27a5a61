import { expect, test } from 'vitest';
import { besidePanels, coverByPanels, ROOM_X, ROOM_Y } from './beside-panels.ts';

const card = { left: 100, top: 50, right: 200, bottom: 150 };

test('a number that a card covers in part moves beside it, the shortest way', () => {
  expect(besidePanels({ x: 95, y: 100 }, [card])).toEqual({ x: 5 - ROOM_X, y: 0 });
  expect(besidePanels({ x: 210, y: 100 }, [card])).toEqual({ x: ROOM_X - 10, y: 0 });
  expect(besidePanels({ x: 150, y: 45 }, [card])).toEqual({ x: 0, y: 5 - ROOM_Y });
  expect(besidePanels({ x: 150, y: 152 }, [card])).toEqual({ x: 0, y: ROOM_Y - 2 });
});

test('a number clear of all cards, and one whose station a card covers, stay', () => {
  expect(besidePanels({ x: 50, y: 100 }, [card])).toEqual({ x: 0, y: 0 });
  expect(besidePanels({ x: 101, y: 100 }, [card])).toEqual({ x: 0, y: 0 });
});

test('a number is covered in part where another part is in sight', () => {
  expect(coverByPanels({ x: 90, y: 100 }, [card])).toBe('part');
  expect(coverByPanels({ x: 110, y: 100 }, [card])).toBe('part');
  expect(coverByPanels({ x: 100 - ROOM_X, y: 100 }, [card])).toBe('none');
  expect(coverByPanels({ x: 90, y: 150 + ROOM_Y }, [card])).toBe('none');
  expect(coverByPanels({ x: 100 + ROOM_X, y: 150 - ROOM_Y }, [card])).toBe('whole');
});
