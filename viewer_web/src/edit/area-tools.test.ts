import { beforeEach, expect, test } from 'vitest';
import type { Change } from '../api/documents.ts';
import type { Question, ReviewClient } from '../api/review-client.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { PointerPlace } from '../scene/pointer.ts';
import type { Picked } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { EMPTY_REVIEW } from '../testing/fake-review-server.ts';
import { AreaTools } from './area-tools.ts';
import { createEditing, type Tool } from './state.ts';

const element = (sceneIndex: number, kind: string, firstTriangle: number) => ({
  ...{ sceneIndex, name: '', kind, sourceId: `id ${sceneIndex}`, floorId: 'F0', file: 0 },
  ...{ firstTriangle, nTriangles: 1 },
});
const [WALL, DOOR] = [element(0, 'IfcWall', 0), element(1, 'IfcDoor', 1)];
const cornersM = Float32Array.from([0, 0, 0, 5, 0, 0, 5, 0, 3, 6, 0, 0, 7, 0, 0, 7, 0, 2]);
const LOADED = {
  plan: { floors: [] },
  stage: { elements: [WALL, DOOR], triangles: { cornersM }, floors: [], offsetM: [1000, 0, 0] },
} as unknown as LoadedPlan;

const REVIEW = { ...EMPTY_REVIEW, doors: { 'id 1': 'open' } };

let picked: Partial<Picked> | null;
let done: (readonly Change[])[];
let said: string[];
let question: { value: Question | null };
let use: (tool: Tool, loaded?: LoadedPlan) => void;
beforeEach(() => {
  [done, said, question] = [[], [], { value: null }];
  const reviewClient = {
    canEdit: { value: true },
    review: { value: REVIEW, peek: () => REVIEW },
    question,
    notice: {
      set value(notice: { text: string }) {
        said.push(notice.text);
      },
    },
    warn: (words: string) => said.push(words),
    commit: async (_: string, changes: readonly Change[]) => done.push(changes),
  } as unknown as ReviewClient;
  const view = { surfaceAt: () => picked } as unknown as PlanView;
  const editing = createEditing();
  const [tab, planBase] = [{ value: 'edit' }, { value: OWN_PLAN }];
  use = (tool, loaded = LOADED) => {
    const shown = { loaded: { value: loaded }, floorId: { peek: () => null } };
    const store = { editing, reviewClient, tab, planBase, ...shown } as unknown as Store;
    editing.tool.value = tool;
    editing.doorState.value = 'shut';
    editing.marksGround.value = false;
    const tools = new AreaTools(store, reviewClient, view, loaded, async () => undefined);
    expect(tools.consumer.onClick?.({ clientX: 0, clientY: 0 } as PointerPlace)).toBe(true);
  };
});

test('an entrance is on a floor, where it was clicked', () => {
  picked = { element: WALL, groundOf: 'F0', isSection: false, pointM: [1002, 1, 0] };
  use('entrance');
  expect(done).toEqual([[{ kind: 'add_entrance', entrance: { id: '', position_m: [1002, 1, 0], floor: 'F0' } }]]);
  for (const missed of [{ ...picked, groundOf: null }, { ...picked, isSection: true }, null]) {
    picked = missed;
    use('entrance');
  }
  expect(done).toHaveLength(1);
  expect(said).toEqual([
    'An entrance is on a walkable floor: click on one.',
    'No surface under the pointer: click on one.',
    'No surface under the pointer: click on one.',
  ]);
});

test('a door is marked where it is clicked, cut open or not, or beside it', () => {
  const marked = [{ kind: 'set_door', door: 'id 1', state: 'shut' }];
  for (const isSection of [true, false]) {
    picked = { element: DOOR, groundOf: null, isSection, pointM: [1006, 0, 1] };
    use('doors');
  }
  picked = { element: WALL, groundOf: 'F0', isSection: false, pointM: [1005.7, 0, 0] };
  use('doors');
  expect(done).toEqual([marked, marked, marked]);
  picked = { ...picked, pointM: [1002, 0, 0] };
  use('doors');
  use('doors', { ...LOADED, stage: { ...LOADED.stage, elements: [WALL] } });
  expect(done).toHaveLength(3);
  expect(said).toEqual([
    'No door there: click on one.',
    'No door is drawn: the scene file marks none, or those that are open have no frame.',
  ]);
});

test('a floor that stations stand on is marked as none only after a yes, which names them', () => {
  const floor = {
    triangles: { cornersM: Float32Array.from([0, 0, 0, 9, 0, 0, 0, 9, 0]), groundOf: Uint8Array.of(1) },
    floors: [{ id: 'F0', index: 0 }],
    offsetM: [0, 0, 0],
  };
  const station = (id: string, x: number) => ({ id, floor: 'F0', position: [x, 1, 1.5], instrument_height_m: 1.5 });
  const on = (...stations: unknown[]) =>
    ({ plan: { floors: [], stations }, stage: { ...LOADED.stage, ...floor } }) as unknown as LoadedPlan;
  picked = { element: WALL, groundOf: 'F0', isSection: false, pointM: [2, 1, 0], triangle: 0 };
  const marked = [{ kind: 'pick_ground', pick: { point_m: [2, 1, 0], is_ground: false, floor: '' } }];
  use('ground', on(station('S001', 20)));
  expect([done, question.value]).toEqual([[marked], null]);
  use('ground', on(station('S001', 2), station('S002', 3), station('S003', 20)));
  expect(done).toHaveLength(1);
  expect(question.value!.text).toMatch(/^2 stations stand on this floor: S001, S002\./);
  question.value!.onYes();
  expect(done).toEqual([marked, marked]);
});
