/** Stages of one file and of several, as usd-core writes them (tests/viewer_web/files_fixture.py). */
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, test } from 'vitest';
import { runPython } from '../testing/python.ts';
import { readStage, type Stage } from './stage.ts';

function stageOf(...files: string[]): Stage {
  const folder = mkdtempSync(join(tmpdir(), 'stage-'));
  const path = join(folder, 'stage.usdc');
  try {
    runPython('tests/viewer_web/files_fixture.py', path, ...files);
    return readStage(Uint8Array.from(readFileSync(path)).buffer);
  } finally {
    rmSync(folder, { recursive: true });
  }
}
const filesOf = ({ elements }: Stage): [number, number][] => elements.map(({ sceneIndex, file }) => [sceneIndex, file]);

test('elements know their file, also where files have one name or one that begins as another', () => {
  const stage = stageOf('a.ifc=2', 'a.ifc=1', 'a.ifc.ifc=1');
  expect(stage.files).toEqual(['a.ifc', 'a.ifc', 'a.ifc.ifc']);
  expect(filesOf(stage)).toEqual([
    [0, 0],
    [1, 0],
    [2, 1],
    [3, 2],
  ]);
});

test('a stage of one file has no list of files', () => {
  const stage = stageOf();
  expect(stage.files).toEqual([]);
  expect(filesOf(stage)).toEqual([
    [0, 0],
    [1, 0],
  ]);
});
