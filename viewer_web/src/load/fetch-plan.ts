/** Fetches a plan from the server, telling how far it is. */

import type { SerializedBVH } from 'three-mesh-bvh';
import { NO_TOKEN } from '../api/api-error.ts';
import { OUT_OF_SCOPE, REASON } from '../heat/layers.ts';
import { withinScope } from '../heat/scope.ts';
import { t } from '../language/language.ts';
import { readCloud, type ThinnedCloud, type Thinning } from './cloud-rows.ts';
import type { StageEdges } from './edges.ts';
import { decodeValues, type LayersJson, parseLayers } from './layers.ts';
import { planUrl } from './plan-base.ts';
import { type PlanJson, parsePlan } from './plan-json.ts';
import { MissingFileError, PlanLoadError } from './plan-load-error.ts';
import { prepareBeside } from './prepare-beside.ts';
import { readStage, type Stage, type StageStation } from './stage.ts';

export interface LoadedPlan {
  /** The plan's folder, see `planUrl`. */
  readonly base: string;
  readonly plan: PlanJson;
  readonly stage: Stage;
  readonly edges: StageEdges;
  /** Its triangles, for rays. */
  readonly tree: SerializedBVH;
  /** One byte a patch: stations that see it; 255: not achievable; 254: not asked for. */
  readonly patchSeen: Uint8Array;
  /** Reason of each patch, where it tells what need not be covered; null: all is to be. See heat/scope.ts. */
  readonly scope: Uint8Array | null;
  /** How much of each patch counts, in 255ths; null: all of it. */
  readonly counted: Uint8Array | null;
  /** Null: an older version made the plan, and it says nothing of ranges, incidences and reasons by patch. */
  readonly layers: LayersJson | null;
}

/** What of it the field view needs. */
export type FieldPlan = Pick<LoadedPlan, 'base' | 'plan' | 'stage' | 'layers'>;

/** `fraction` 0 ... 1 of the bytes of this step; null where it is not known. */
export type OnStep = (step: string, fraction: number | null) => void;

export async function fetchPlan(base: string, onStep: OnStep): Promise<LoadedPlan> {
  onStep(t('Reading the plan'), null);
  const plan = parsePlan(parseJson('plan.json', await fetchBytes(base, 'plan.json')));
  const stageBytes = await fetchBytes(base, 'viewer/stage.usdc', (share) => onStep(t('Loading the building'), share));
  const patchBytes = await fetchBytes(base, 'viewer/patches.u8', (share) => onStep(t('Loading the coverage'), share));
  const layers = await fetchLayers(base);
  onStep(t('Preparing the building'), null);
  const prepared = await prepareBeside(stageBytes);
  checkPatches(prepared.stage, patchBytes.byteLength);
  const scope = await fetchScope(base, plan, patchBytes.byteLength);
  const patchSeen = withinScope(new Uint8Array(patchBytes), scope);
  const counted = layers?.counted ? await fetchCounted(base, layers.counted, patchBytes.byteLength) : null;
  return { base, plan, patchSeen, scope, layers, counted, ...prepared };
}

/** The plan without what only its picture needs. */
export async function fetchFieldPlan(base: string, onStep: OnStep): Promise<FieldPlan> {
  onStep(t('Reading the plan'), null);
  const plan = parsePlan(parseJson('plan.json', await fetchBytes(base, 'plan.json')));
  const stageBytes = await fetchBytes(base, 'viewer/stage.usdc', (share) => onStep(t('Loading the building'), share));
  return { base, plan, stage: readStage(stageBytes), layers: await fetchLayers(base) };
}

/** How much of each patch counts, in 255ths. */
async function fetchCounted(base: string, file: string, nPatches: number): Promise<Uint8Array> {
  return decodeValues(file, await fetchBytes(base, `viewer/${file}`), nPatches, 1) as Uint8Array;
}

/** The reasons of patches, where some need not be covered; null: all are to be, or the plan is too old to tell. */
export async function fetchScope(
  base: string,
  { requirements: { floors }, scope }: PlanJson,
  nPatches: number,
  signal?: AbortSignal,
): Promise<Uint8Array | null> {
  const outsideM2 =
    (scope?.out_of_scope_area_m2 ?? 0) + (scope?.obstacles ?? []).reduce((sum, { area_m2 }) => sum + area_m2, 0);
  if (!floors?.length && outsideM2 === 0) return null;
  try {
    const bytes = await fetchBytes(base, 'viewer/reason.u8', undefined, signal);
    const reasons = decodeValues('reason.u8', bytes, nPatches, 1) as Uint8Array;
    // All floors may be named one by one.
    return reasons.includes(OUT_OF_SCOPE) ? reasons : null;
  } catch (error) {
    if (error instanceof MissingFileError) return null;
    throw error;
  }
}

/** The cloud of a station, thinned. */
export async function fetchCloud(
  base: string,
  station: StageStation,
  thinning: Thinning,
  signal: AbortSignal,
): Promise<ThinnedCloud> {
  const { body } = await request(base, `viewer/${station.cloudUri}`, { signal });
  return readCloud(body, station, thinning, !station.cloudUri.endsWith('.u16'));
}

/** What a station sees, one bit a patch; where limits are required, once more within them. */
export async function fetchSeen({ base, patchSeen }: LoadedPlan, station: StageStation): Promise<Uint8Array> {
  const file = seenFile(station);
  const bits = new Uint8Array(await fetchBytes(base, `viewer/${file}`));
  const nBytes = Math.ceil(patchSeen.length / 8);
  if (bits.length !== nBytes && bits.length !== 2 * nBytes) {
    throw new PlanLoadError(
      t('{file}: {n} bytes, expected {expected}. Write the plan again.', {
        file: `viewer/${file}`,
        n: bits.length,
        expected: nBytes,
      }),
    );
  }
  return bits;
}

/** One bit of a station's seen file; where the host serves parts of files, one byte of it. */
export async function fetchSeenBit({ base }: LoadedPlan, station: StageStation, bit: number): Promise<boolean> {
  const byte = bit >> 3;
  const file = `viewer/${seenFile(station)}`;
  const { body, status } = await request(base, file, { headers: { Range: `bytes=${byte}-${byte}` } });
  const bits = new Uint8Array(await new Response(body).arrayBuffer());
  const value = status === 206 ? bits[0] : bits[byte];
  if (value === undefined)
    throw new PlanLoadError(t('{file}: too short for bit {bit}. Write the plan again.', { file, bit }));
  return ((value >> (bit & 7)) & 1) === 1;
}

/** Name of another file of a station. */
const fileOf = (cloudUri: string, folder: string, suffix: string): string =>
  cloudUri.replace(/^clouds\/(.*)\.\w+$/, `${folder}/$1.${suffix}`);

const seenFile = ({ cloudUri }: StageStation): string => fileOf(cloudUri, 'seen', 'bits');

/** What each requirement would lose without a station, see `parseLost`. */
export async function fetchLost({ base }: LoadedPlan, station: StageStation): Promise<ArrayBuffer> {
  const file = fileOf(station.cloudUri, 'lost', 'u32');
  return fetchBytes(base, `viewer/${file}`);
}

/** Values of a layer of the plan folder, by its id. */
export async function fetchPatchValues({ base, layers, patchSeen }: LoadedPlan, id: string, signal: AbortSignal) {
  const isReason = id === REASON;
  const file = isReason ? 'reason.u8' : layers?.layers.find((layer) => layer.id === id)?.file;
  if (file === undefined) {
    throw new PlanLoadError(t('The plan has no layer {id}: an older version made it. Plan again to see it.', { id }));
  }
  const buffer = await fetchBytes(base, `viewer/${file}`, undefined, signal);
  return decodeValues(file, buffer, patchSeen.length, isReason ? 1 : 2);
}

/** Number of the room of each patch, see `LayersJson`. */
export async function fetchPatchRooms({ base, layers, patchSeen }: LoadedPlan): Promise<Uint16Array> {
  const file = layers?.rooms?.file ?? '';
  return decodeValues(file, await fetchBytes(base, `viewer/${file}`), patchSeen.length, 2) as Uint16Array;
}

/** Of each patch the one that names its piece of unseen surface, -1 none; null: an older version made the plan. */
export async function fetchPieces({ base, layers, patchSeen }: LoadedPlan): Promise<Int32Array | null> {
  if (layers?.pieces === null || layers === null) return null;
  const bytes = await fetchBytes(base, `viewer/${layers.pieces}`);
  if (bytes.byteLength !== 4 * patchSeen.length) {
    throw new PlanLoadError(
      t('{file}: {n} bytes, expected {expected}. Write the plan again.', {
        file: `viewer/${layers.pieces}`,
        n: bytes.byteLength,
        expected: 4 * patchSeen.length,
      }),
    );
  }
  return new Int32Array(bytes);
}

async function fetchLayers(base: string): Promise<LayersJson | null> {
  try {
    return parseLayers(parseJson('viewer/layers.json', await fetchBytes(base, 'viewer/layers.json')));
  } catch (error) {
    if (error instanceof MissingFileError) return null;
    throw error;
  }
}

/** The shader does not check: a stage and patches of two different plans must not meet there. */
function checkPatches({ triangles }: Stage, nPatches: number): void {
  let needed = 0;
  for (let i = 0; i < triangles.count; i++) {
    needed = Math.max(needed, triangles.firstPatch[i] + 2 ** triangles.patchDepth[i]);
  }
  if (needed > nPatches) {
    throw new PlanLoadError(
      t(
        'viewer/patches.u8: {n} patches, expected at least {needed} for viewer/stage.usdc. Write the plan again with `tlsplan plan`.',
        { n: nPatches, needed },
      ),
    );
  }
}

/** The bytes of a file of the plan folder `base`. */
export async function fetchBytes(
  base: string,
  path: string,
  onShare: (share: number | null) => void = () => undefined,
  signal?: AbortSignal,
): Promise<ArrayBuffer> {
  const { headers, body } = await request(base, path, signal ? { signal } : {});
  const total = headers.has('content-encoding') ? 0 : Number(headers.get('content-length') ?? 0);
  return collect(body, total, onShare);
}

async function request(base: string, path: string, asked: RequestInit) {
  const response = await fetch(planUrl(base, path), asked).catch((error: unknown) => {
    if (asked.signal?.aborted) throw error;
    throw new PlanLoadError(t('{path}: the server does not answer. Is `tlsplan view` still running?', { path }));
  });
  if (response.status === 404) {
    throw new MissingFileError(
      t('{path}: the server answered 404. The plan folder is not complete; write it again.', { path }),
    );
  }
  const { body, headers, status } = response;
  if (response.status === 401) throw new PlanLoadError(NO_TOKEN);
  if (!response.ok || body === null) {
    throw new PlanLoadError(
      t('{path}: the server answered {status}. {text}', { path, status: response.status, text: await response.text() }),
    );
  }
  return { headers, body, status };
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

function parseJson(path: string, bytes: ArrayBuffer): unknown {
  try {
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch (error) {
    throw new PlanLoadError(
      t('{path}: not JSON ({why}). Write the plan again.', { path, why: (error as Error).message }),
    );
  }
}
