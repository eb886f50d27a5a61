/** The crate reader against files that usd-core wrote (tests/viewer_web/crate_fixture.py). */
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { runPython } from '../testing/python.ts';
import { type CratePrim, readCrate } from './crate.ts';
import { PlanLoadError } from './plan-load-error.ts';

const N_FACES = 40;
let folder: string;
let file: ArrayBuffer;
let prims: Map<string, CratePrim>;

beforeAll(() => {
  folder = mkdtempSync(join(tmpdir(), 'crate-'));
  const path = join(folder, 'stage.usdc');
  runPython('tests/viewer_web/crate_fixture.py', path);
  file = Uint8Array.from(readFileSync(path)).buffer;
  prims = new Map(readCrate(file).map((prim) => [prim.path, prim]));
});
afterAll(() => rmSync(folder, { recursive: true }));

const wall = (index: number): CratePrim => prims.get(`/Plan/Building/Storey_0/Group_0/Wall_${index}`)!;
const range = (n: number): number[] => [...Array(n).keys()];

test('crate reader finds every prim with its type', () => {
  expect([...prims.keys()].sort()).toEqual([
    '/Plan',
    '/Plan/Building',
    '/Plan/Building/Storey_0',
    '/Plan/Building/Storey_0/Group_0',
    ...range(3).map((i) => `/Plan/Building/Storey_0/Group_0/Wall_${i}`),
    '/Plan/Empty',
  ]);
  expect(wall(2).typeName).toBe('Mesh');
  expect(prims.get('/Plan')!.typeName).toBe('Xform');
});

test('crate reader reads doubles and vectors, inlined and stored', () => {
  const plan = prims.get('/Plan')!;
  expect(plan.get('tlsplan:offsetX')).toBe(500000.1);
  expect(plan.get('tlsplan:half')).toBe(0.5);
  expect([...(plan.get('tlsplan:offset') as Float64Array)]).toEqual([500000.1, 5400000, 12]);
  expect([...(plan.get('small:offset') as Float64Array)]).toEqual([1, -2, 3]);
});

test('crate reader reads strings, tokens and negative integers', () => {
  expect(wall(1).get('tlsplan:name')).toBe('Außenwand 1');
  expect(wall(1).get('tlsplan:floor')).toBe('');
  expect(wall(1).get('tlsplan:kind')).toBe('IfcWall');
  expect(range(3).map((i) => wall(i).get('tlsplan:element'))).toEqual([-1, 0, 1]);
  expect(wall(1).get('tlsplan:nothing')).toBeUndefined();
});

test('crate reader reads matrices, identity and others', () => {
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  expect([...(wall(0).get('xformOp:transform') as Float64Array)]).toEqual(identity);
  const moved = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.25, 1e-9, 2, 1];
  expect([...(wall(2).get('xformOp:transform') as Float64Array)]).toEqual(moved);
});

test('crate reader reads geometry', () => {
  const points = range(N_FACES).flatMap((i) => [Math.fround(0.1 * i), 1, Math.fround(-1.5 * i)]);
  expect([...(wall(1).get('points') as Float32Array)].map((x) => x + 0)).toEqual(points.map((x) => x + 0));
  const indices = range(3 * N_FACES).map((i) => (7 * i) % N_FACES);
  expect([...(wall(0).get('faceVertexIndices') as Int32Array)]).toEqual(indices);
});

test('crate reader reads every coding of integer and float arrays', () => {
  const expected: Record<string, number[]> = {
    large: range(N_FACES).map((i) => (i % 2 ? 2 ** 30 + 1000003 * i : 0 - i)),
    steps: range(N_FACES).map((i) => 300 * i * (i % 2 ? -1 : 1)),
    same: range(N_FACES).map(() => 7),
    short: [3, -1, 2],
    empty: [],
    whole: range(N_FACES).map((i) => i - 3),
    few: range(N_FACES).map((i) => Math.fround([0.1, 0.7, -1][i % 3])),
    many: range(N_FACES).map((i) => Math.fround(0.1 * i * i)),
  };
  for (const [name, numbers] of Object.entries(expected)) {
    const read = wall(0).get(`primvars:tlsplan:${name}`) as Int32Array | Float32Array;
    expect([...read], name).toEqual(numbers.map((x) => x + 0));
  }
});

test('crate reader says in words that a file is damaged, wherever it is cut', () => {
  expect(() => readCrate(new ArrayBuffer(0))).toThrow(PlanLoadError);
  expect(() => readCrate(new TextEncoder().encode('#usda 1.0'.padEnd(200)).buffer)).toThrow(/begin like a USD crate/);
  const cut = file.slice(0, file.byteLength - 20);
  expect(() => readCrate(cut)).toThrow(PlanLoadError);
});
