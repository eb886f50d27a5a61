/** Views that somebody named, kept by this browser for one scene: its other plans have them too. */
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { formatUrlState, parseUrlState, type UrlState } from '../url-state.ts';

export interface SavedView {
  readonly name: string;
  /** As in the address: `#floor=F0&camera=…`. */
  readonly hash: string;
}

export type ViewStorage = Pick<Storage, 'getItem' | 'setItem'>;

export const MOST_VIEWS = 40;
export const LONGEST_NAME = 60;
const LONGEST_HASH = 2000;

export function viewsKey({ file, sha256 }: Pick<PlanJson['scene'], 'file' | 'sha256'>): string {
  return `tlsplan-views ${sha256 || file}`;
}

/** In the order in which they were saved; null: what is kept can't be read. */
export function readViews(storage: () => ViewStorage, key: string): readonly SavedView[] | null {
  try {
    const kept: unknown = JSON.parse(storage().getItem(key) ?? '[]');
    return Array.isArray(kept) ? kept.filter(isView).slice(0, MOST_VIEWS) : null;
  } catch {
    return null;
  }
}

function isView(one: unknown): one is SavedView {
  const { name, hash } = (one ?? {}) as Partial<Record<keyof SavedView, unknown>>;
  return typeof name === 'string' && name !== '' && typeof hash === 'string' && hash.length <= LONGEST_HASH;
}

/** Whether the browser took them. */
export function writeViews(storage: () => ViewStorage, key: string, views: readonly SavedView[]): boolean {
  try {
    storage().setItem(key, JSON.stringify(views));
    return true;
  } catch {
    return false;
  }
}

/** With one more; a text: why not. */
export function withView(views: readonly SavedView[], name: string, hash: string): readonly SavedView[] | string {
  if (views.length >= MOST_VIEWS) return t('{n} views are kept, and no more: delete one first.', { n: MOST_VIEWS });
  if (hash.length > LONGEST_HASH) return t('This view hides too many files to be kept.');
  return [...views, { name: freeName(name, views), hash }];
}

export function renamed(views: readonly SavedView[], old: string, name: string): readonly SavedView[] {
  const others = views.filter((one) => one.name !== old);
  return views.map((one) => (one.name === old ? { ...one, name: freeName(name, others) } : one));
}

/** Names are what views are found by: one that is taken gets a number. */
export function freeName(wanted: string, views: readonly SavedView[]): string {
  const name = wanted.trim().slice(0, LONGEST_NAME);
  const isTaken = (one: string): boolean => views.some((view) => view.name === one);
  let free = name;
  for (let i = 2; isTaken(free); i++) free = `${name.slice(0, LONGEST_NAME - 5)} (${i})`;
  return free;
}

/** What the address has, with the camera as it stands, of whichever plan of the scene. */
export function hashToKeep(hash: string, camera: readonly number[]): string {
  return formatUrlState({ ...parseUrlState(hash), planBase: null, camera });
}

/** The view in the plan that is open now. */
export function stateOfView({ hash }: SavedView, now: string): UrlState {
  return { ...parseUrlState(hash), planBase: parseUrlState(now).planBase };
}
