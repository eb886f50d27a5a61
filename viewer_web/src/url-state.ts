import type { SectionBox, SectionLine } from './section/planes.ts';

/** What of the view stands in the address, so that it can be sent on: `#floor=F0&station=S003&layer=range`. */

export interface UrlState {
  readonly floorId: string | null;
  readonly stationId: string | null;
  readonly layerId: string | null;
  readonly tab: string | null;
  /** `field`, `drawing`; null: the whole plan. */
  readonly view: string | null;
  /** Two station ids. */
  readonly pair: readonly [string, string] | null;
  /** Plan folders below that of the page: the one shown, the one compared with. */
  readonly planBase: string | null;
  readonly compareBase: string | null;
  /** Camera: position and target, local metres. */
  readonly camera: readonly number[] | null;
  /** The camera is a person walking. */
  readonly isWalking: boolean;
  /** Height of the cut, metres; null: the usual one. */
  readonly cutM: number | null;
  /** What a section cuts away, local metres. */
  readonly sectionBox: SectionBox | null;
  readonly sectionLine: SectionLine | null;
  /** What is drawn besides, or differently from what is usual. */
  readonly shows: readonly Shown[];
  /** Numbers of the files that are not drawn, of a scene of several. */
  readonly hiddenFiles: readonly number[];
}

/** `whole`: floors are not lifted apart; `open`: without ceilings; `flat`: the plan view; `square`: the section along a line, as such. */
export const SHOWN = ['links', 'clouds', 'route', 'whole', 'open', 'flat', 'square'] as const;
export type Shown = (typeof SHOWN)[number];

export const NO_STATE: UrlState = {
  floorId: null,
  stationId: null,
  layerId: null,
  tab: null,
  view: null,
  pair: null,
  planBase: null,
  compareBase: null,
  camera: null,
  isWalking: false,
  cutM: null,
  sectionBox: null,
  sectionLine: null,
  shows: [],
  hiddenFiles: [],
};

export function parseUrlState(hash: string): UrlState {
  const params = new URLSearchParams(hash.replace(/^#/, ''));
  const pair = params.getAll('pair').filter((id) => id !== '');
  const numbers = (key: string, n: number): readonly number[] | null => {
    const found = (params.get(key) ?? '').split(',').map(Number);
    return found.length === n && found.every(Number.isFinite) ? found : null;
  };
  return {
    floorId: params.get('floor') || null,
    stationId: params.get('station') || null,
    layerId: params.get('layer') || null,
    tab: params.get('tab') || null,
    view: params.get('view') || null,
    pair: pair.length === 2 ? [pair[0], pair[1]] : null,
    planBase: params.get('plan') || null,
    // Empty: the plan the page was started for.
    compareBase: params.get('compare'),
    camera: numbers('camera', 6),
    isWalking: params.get('walk') === '1',
    cutM: Number(params.get('cut')) > 0 ? Number(params.get('cut')) : null,
    sectionBox: boxOf(numbers('box', 6)),
    sectionLine: lineOf(numbers('line', 4)),
    shows: SHOWN.filter((one) => (params.get('show') ?? '').split(',').includes(one)),
    hiddenFiles: (params.get('without') ?? '')
      .split(',')
      .filter((number) => /^\d+$/.test(number))
      .map(Number),
  };
}

function boxOf(sides: readonly number[] | null): SectionBox | null {
  if (sides === null) return null;
  const [x, y, z, toX, toY, toZ] = sides;
  return x < toX && y < toY && z < toZ ? { minM: [x, y, z], maxM: [toX, toY, toZ] } : null;
}

function lineOf(ends: readonly number[] | null): SectionLine | null {
  if (ends === null) return null;
  const [x, y, toX, toY] = ends;
  return Math.hypot(toX - x, toY - y) > 0 ? { fromM: [x, y], toM: [toX, toY], isFlipped: false } : null;
}

/** What is kept lies to the left of a line, so one that is flipped goes the other way. */
function endsOf({ fromM, toM, isFlipped }: SectionLine): number[] {
  return isFlipped ? [...toM, ...fromM] : [...fromM, ...toM];
}

export function formatUrlState(state: UrlState): string {
  const params = new URLSearchParams();
  const set = (key: string, value: string | null): void => {
    if (value !== null) params.append(key, value);
  };
  set('view', state.view);
  set('plan', state.planBase);
  set('compare', state.compareBase);
  set('floor', state.floorId);
  set('station', state.stationId);
  set('layer', state.layerId);
  set('tab', state.tab);
  for (const id of state.pair ?? []) set('pair', id);
  const setNumbers = (key: string, numbers: readonly number[] | null): void =>
    set(key, numbers === null ? null : numbers.map((x) => +x.toFixed(3)).join(','));
  setNumbers('camera', state.camera);
  set('cut', state.cutM === null ? null : String(+state.cutM.toFixed(2)));
  setNumbers('box', state.sectionBox && [...state.sectionBox.minM, ...state.sectionBox.maxM]);
  setNumbers('line', state.sectionLine && endsOf(state.sectionLine));
  set('show', state.shows.length === 0 ? null : state.shows.join(','));
  set('without', state.hiddenFiles.length === 0 ? null : state.hiddenFiles.join(','));
  set('walk', state.isWalking ? '1' : null);
  const text = params.toString().replaceAll('%2F', '/').replaceAll('%2C', ',');
  return text === '' ? '' : `#${text}`;
}
