/** Fetches a plan from the server, telling how far it is. */
import { type Cloud, decodeCloud } from './cloud.ts';
import { findEdges, type StageEdges } from './edges.ts';
import { type PlanJson, parsePlan } from './plan-json.ts';
import { PlanLoadError } from './plan-load-error.ts';
import { readStage, type Stage, type StageStation } from './stage.ts';

export interface LoadedPlan {
  readonly plan: PlanJson;
  readonly stage: Stage;
  readonly edges: StageEdges;
  /** One byte a patch: stations that see it; 255: not achievable. */
  readonly patchSeen: Uint8Array;
}

/** `fraction` 0 ... 1 of the bytes of this step; null where it is not known. */
export type OnStep = (step: string, fraction: number | null) => void;

const PLAN_URL = '/plan/';

export async function fetchPlan(onStep: OnStep): Promise<LoadedPlan> {
  onStep('Reading the plan', null);
  const plan = parsePlan(parseJson(await fetchBytes('plan.json', () => undefined)));
  const stageBytes = await fetchBytes('viewer/stage.usdc', (share) => onStep('Loading the building', share));
  const patchBytes = await fetchBytes('viewer/patches.u8', (share) => onStep('Loading the coverage', share));
  onStep('Preparing the building', null);
  await nextFrame();
  const stage = readStage(stageBytes);
  const patchSeen = new Uint8Array(patchBytes);
  checkPatches(stage, patchSeen.length);
  return { plan, stage, patchSeen, edges: findEdges(stage.triangles, stage.elements) };
}

export async function fetchCloud(station: StageStation, signal: AbortSignal): Promise<Cloud> {
  return decodeCloud(await fetchBytes(`viewer/${station.cloudUri}`, () => undefined, signal), station);
}

/** The shader does not check: a stage and patches of two different plans must not meet there. */
function checkPatches({ triangles }: Stage, nPatches: number): void {
  let needed = 0;
  for (let t = 0; t < triangles.count; t++) {
    needed = Math.max(needed, triangles.firstPatch[t] + 2 ** triangles.patchDepth[t]);
  }
  if (needed > nPatches) {
    throw new PlanLoadError(
      `viewer/patches.u8: ${nPatches} patches, expected at least ${needed} for viewer/stage.usdc. ` +
        'Write the plan again with `tlsplan plan`.',
    );
  }
}

async function fetchBytes(path: string, onShare: (share: number | null) => void, signal?: AbortSignal) {
  const response = await fetch(PLAN_URL + path, signal ? { signal } : {}).catch((error: unknown) => {
    if (signal?.aborted) throw error;
    throw new PlanLoadError(`${path}: the server does not answer. Is \`tlsplan view\` still running?`);
  });
  if (!response.ok || response.body === null) {
    const remedy = response.status === 404 ? 'The plan folder is not complete; write it again.' : await response.text();
    throw new PlanLoadError(`${path}: the server answered ${response.status}. ${remedy}`);
  }
  const total = response.headers.has('content-encoding') ? 0 : Number(response.headers.get('content-length') ?? 0);
  return collect(response.body, total, onShare);
}

async function collect(body: ReadableStream<Uint8Array>, total: number, onShare: (share: number | null) => void) {
  const chunks: Uint8Array[] = [];
  let received = 0;
  const reader = body.getReader();
  for (let step = await reader.read(); !step.done; step = await reader.read()) {
    chunks.push(step.value);
    received += step.value.length;
    onShare(total > 0 ? received / total : null);
  }
  const bytes = new Uint8Array(received);
  let at = 0;
  for (const chunk of chunks) {
    bytes.set(chunk, at);
    at += chunk.length;
  }
  return bytes.buffer;
}

function parseJson(bytes: ArrayBuffer): unknown {
  try {
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch (error) {
    throw new PlanLoadError(`plan.json: not JSON (${(error as Error).message}). Write the plan again.`);
  }
}

/** Let the page draw before work that blocks it. */
export function nextFrame(): Promise<void> {
  return new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
}
