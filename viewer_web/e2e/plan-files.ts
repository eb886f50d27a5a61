/** The plan folder that the browser tests show, read directly: what the viewer says is compared with it. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { type LayersJson, parseLayers } from '../src/load/layers.ts';
import { type PlanJson, parsePlan } from '../src/load/plan-json.ts';

export class PlanFiles {
  readonly plan: PlanJson;

  constructor(private readonly folder: string) {
    this.plan = parsePlan(JSON.parse(this.text('plan.json')));
  }

  get layers(): LayersJson {
    return parseLayers(JSON.parse(this.text('viewer/layers.json')));
  }

  /** Values of a layer of two bytes a patch. */
  values(file: string): Uint16Array {
    const bytes = readFileSync(join(this.folder, 'viewer', file));
    return new Uint16Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  }

  bytes(file: string): Uint8Array {
    return readFileSync(join(this.folder, 'viewer', file));
  }

  private text(file: string): string {
    return readFileSync(join(this.folder, file), 'utf8');
  }
}
