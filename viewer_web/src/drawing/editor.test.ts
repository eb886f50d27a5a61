import { expect, test } from 'vitest';
import { ApiError } from '../api/api-error.ts';
import type { Drawn } from '../api/documents.ts';
import { DrawingEditor, linesOf } from './editor.ts';
import { actOn } from './keys.ts';

const wall = (id: string) => ({ id, outline: [[0, 0], [2, 0], [2, 0.2], [0, 0.2]], holes: [] }); // biome-ignore format: a rectangle
const FIRST = {
  revision: 3,
  name: 'house',
  scale: 1,
  storeys: [{ name: 'Ground', walls: [wall('W1')], openings: [], texts: [], stairs: [] }],
} as unknown as Drawn;
const named = (name: string): Drawn => ({ ...FIRST, name });

/** Keeps drawings as the server does: an older revision is refused. */
class FakeServer {
  drawing = FIRST;
  refuses: string | null = null;
  readonly sent: string[] = [];

  json<T>(): Promise<T> {
    return Promise.resolve({ drawing: this.drawing, rooms: [], may_correct: true, has_plan: true } as T);
  }

  post<T>(_: string, body: unknown): Promise<T> {
    const { base_revision, drawing } = body as { base_revision: number; drawing: Drawn };
    this.sent.push(drawing.name);
    if (this.refuses !== null) return Promise.reject(new ApiError(422, this.refuses));
    if (base_revision !== this.drawing.revision) return Promise.reject(new ApiError(409, 'newer'));
    this.drawing = { ...drawing, revision: base_revision + 1 };
    return Promise.resolve({ drawing: this.drawing, rooms: [[]] } as T);
  }
}

async function opened(): Promise<{ server: FakeServer; editor: DrawingEditor }> {
  const server = new FakeServer();
  const editor = new DrawingEditor(server, 0);
  await editor.open();
  return { server, editor };
}

test('steps are saved one after another, undone and redone ones too', async () => {
  const { server, editor } = await opened();
  editor.change(named('a'));
  expect(editor.saving.value).toBe('saving');
  expect(await editor.settled()).toBe(true);
  editor.change(named('b'));
  await editor.settled();
  editor.undo();
  await editor.settled();
  expect([server.drawing.name, server.drawing.revision]).toEqual(['a', 6]);
  editor.redo();
  editor.undo();
  editor.undo();
  expect(editor.canUndo.value).toBe(false);
  expect(await editor.settled()).toBe(true);
  expect([server.drawing.name, editor.drawn.value?.name]).toEqual(['house', 'house']);
  editor.change(named('c'));
  expect(editor.canRedo.value).toBe(false);
});

test('what the server refuses is stated, and the next step is sent all the same', async () => {
  const { server, editor } = await opened();
  server.refuses = 'door O1: got 0 % of it on walls';
  editor.change(named('a'));
  expect(await editor.settled()).toBe(false);
  expect([editor.saving.value, editor.message.value]).toEqual(['refused', 'door O1: got 0 % of it on walls']);
  server.refuses = null;
  editor.undo();
  expect(await editor.settled()).toBe(true);
  expect(editor.message.value).toBeNull();
});

test('where another page was first nothing is sent until one of both is chosen', async () => {
  for (const choice of ['mine', 'theirs']) {
    const { server, editor } = await opened();
    server.drawing = { ...named('other'), revision: 4 };
    editor.change(named('a'));
    expect(await editor.settled()).toBe(false);
    editor.change(named('b'));
    expect(await editor.settled()).toBe(false);
    expect([editor.saving.value, server.sent]).toEqual(['conflict', ['a']]);
    await (choice === 'mine' ? editor.keepMine() : editor.takeTheirs());
    expect([editor.saving.value, editor.drawn.value?.name]).toEqual(['saved', choice === 'mine' ? 'b' : 'other']);
    expect(server.drawing.name).toBe(choice === 'mine' ? 'b' : 'other');
  }
});

test('keys nudge and delete what is chosen, undo, and let go step by step', async () => {
  const { editor } = await opened();
  const press = (key: string, more: object = {}) =>
    actOn({ key, shiftKey: false, ctrlKey: false, metaKey: false, ...more }, editor, true);
  expect(press('Delete')).toBe(false);
  editor.chosen.value = { kind: 'wall', id: 'W1' };
  press('ArrowRight', { shiftKey: true });
  press('ArrowUp');
  expect(editor.drawn.value?.storeys[0].walls[0].outline[0]).toEqual([0.1, 0.01]);
  press('Delete');
  expect(editor.drawn.value?.storeys[0].walls).toEqual([]);
  press('z', { ctrlKey: true });
  expect(editor.drawn.value?.storeys[0].walls).toHaveLength(1);
  press('z', { ctrlKey: true, shiftKey: true });
  expect(editor.drawn.value?.storeys[0].walls).toHaveLength(0);
  editor.tool.value = 'wall';
  editor.begun.value = [[0, 0]];
  press('Escape');
  expect([editor.begun.value, editor.tool.value]).toEqual([[], 'wall']);
  press('Escape');
  expect([editor.tool.value, press('Escape')]).toEqual(['select', false]);
  expect(actOn({ key: 'Delete', shiftKey: false, ctrlKey: false, metaKey: false }, editor, false)).toBe(false);
});

test('lines are steps in millimetres', () => {
  expect(linesOf([[1000, 2000, 500, 0, 0, -250]]).lines).toEqual([[[1, 2], [1.5, 2], [1.5, 1.75]]]); // biome-ignore format: rows
});
