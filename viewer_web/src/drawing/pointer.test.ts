import { expect, test } from 'vitest';
import type { Drawn } from '../api/documents.ts';
import { DrawingEditor } from './editor.ts';
import { DrawingPointer, type Hit } from './pointer.ts';
import { toPage, type ViewBox } from './view-box.ts';

const NOTHING: Hit = { chosen: null, end: null };
const WALL: Hit = { chosen: { kind: 'wall', id: 'W1' }, end: null };
/** A wall from (0, 0) to (5, 0.2). */
const DRAWN = {
  scale: 1,
  storeys: [
    { walls: [{ id: 'W1', outline: [[0, 0], [5, 0], [5, 0.2], [0, 0.2]], holes: [] }], openings: [], texts: [], stairs: [] }, // biome-ignore format: a row
  ],
} as unknown as Drawn;

function drawing() {
  const editor = new DrawingEditor({ json: () => Promise.reject(), post: () => new Promise(() => undefined) }, 1e6);
  editor.drawn.value = DRAWN;
  const seen: { view: ViewBox } = { view: { perM: 100, x: 50, y: 400 } };
  const pointer = new DrawingPointer(
    editor,
    {
      view: () => seen.view,
      setView: (view) => {
        seen.view = view;
      },
      sizes: () => ({ wallM: 0.1, doorM: 0.9, windowM: 1.2 }),
      hover: () => undefined,
    },
    () => true,
  );
  const at = (x: number, y: number) => toPage(seen.view, [x, y]);
  const click = (x: number, y: number, hit = NOTHING) => {
    pointer.press(1, at(x, y), hit);
    pointer.release(1, at(x, y));
  };
  return { editor, pointer, seen, at, click };
}

test('a drawn wall begins on the middle of another, a known length at its faces', () => {
  const { editor, click } = drawing();
  editor.tool.value = 'wall';
  click(2, 0.12);
  expect(editor.begun.value).toEqual([[2, expect.closeTo(0.1)]]);
  click(2.03, 3);
  expect(editor.drawn.value?.storeys[0].walls[1].outline).toEqual([[2.05, 0.1], [2.05, 3], [1.95, 3], [1.95, 0.1]]); // biome-ignore format: corners
  editor.tool.value = 'scale';
  editor.begun.value = [];
  click(0.04, 0.24);
  click(4.97, 0.17);
  expect(editor.begun.value).toEqual([[0, 0.2], [5, 0.2]]); // biome-ignore format: corners
});

test('only what is chosen is dragged, by its own axis; elsewhere the picture goes along', () => {
  const { editor, pointer, seen, at, click } = drawing();
  const drag = (hit: Hit, from: readonly [number, number], to: readonly [number, number]) => {
    const [begin, end] = [at(...from), at(...to)];
    pointer.press(1, begin, hit);
    pointer.move(1, end);
    pointer.release(1, end);
  };
  drag(WALL, [2, 0.1], [2.1, 1.1]);
  expect([seen.view.x, seen.view.y, editor.drawn.value]).toEqual([60, 300, DRAWN]);
  click(2, 0.1, WALL);
  drag(WALL, [2, 0.1], [2.1, 1.1]);
  expect(editor.drawn.value?.storeys[0].walls[0].outline[0]).toEqual([0, 1]);
  drag({ ...WALL, end: 'b' }, [5, 1.1], [6, 1.12]);
  expect(editor.drawn.value?.storeys[0].walls[0].outline[1]).toEqual([6, 1]);
});

test('two fingers zoom about their middle and drag nothing', () => {
  const { editor, pointer, seen } = drawing();
  editor.chosen.value = WALL.chosen;
  pointer.press(1, [100, 100], WALL);
  pointer.press(2, [200, 100], NOTHING);
  pointer.move(2, [300, 100]);
  pointer.release(2, [300, 100]);
  pointer.release(1, [100, 100]);
  expect(seen.view).toEqual({ perM: 200, x: 150 + 2 * (50 - 150) + 50, y: 100 + 2 * 300 });
  expect(editor.drawn.value).toBe(DRAWN);
});
