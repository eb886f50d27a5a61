/** Which stations are scanned, kept on this device and nowhere else. */
import type { PlanJson } from '../load/plan-json.ts';

/** Ticks belong to one plan: another one numbers other places. */
export function tickKey(plan: PlanJson, page: string): string {
  const places = plan.stations.map(({ id, position }) => `${id} ${position.map((x) => x.toFixed(2)).join(' ')}`);
  return `tlsplan-done ${page} ${plan.scene.file} ${checksum(places.join('|'))}`;
}

export type TickStorage = Pick<Storage, 'getItem' | 'setItem' | 'removeItem'>;

/** Ids that were ticked; what can't be read counts as none. */
export function readTicks(storage: TickStorage, key: string): ReadonlySet<string> {
  const text = storage.getItem(key);
  if (text === null) return new Set();
  try {
    const ids: unknown = JSON.parse(text);
    return new Set(Array.isArray(ids) ? ids.filter((id): id is string => typeof id === 'string') : []);
  } catch {
    return new Set();
  }
}

export function writeTicks(storage: TickStorage, key: string, done: ReadonlySet<string>): void {
  if (done.size === 0) storage.removeItem(key);
  else storage.setItem(key, JSON.stringify([...done]));
}

/** 32 bits of FNV-1a, hexadecimal. */
function checksum(text: string): string {
  let hash = 0x811c9dc5;
  for (let i = 0; i < text.length; i++) hash = Math.imul(hash ^ text.charCodeAt(i), 0x01000193);
  return (hash >>> 0).toString(16);
}
