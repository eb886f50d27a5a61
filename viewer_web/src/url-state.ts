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
  /** What is drawn besides, or differently from what is usual. */
  readonly shows: readonly Shown[];
  /** Numbers of the files that are not drawn, of a scene of several. */
  readonly hiddenFiles: readonly number[];
}

/** `whole`: floors are not lifted apart; `open`: without ceilings; `flat`: the plan view. */
export const SHOWN = ['links', 'clouds', 'route', 'whole', 'open', 'flat'] as const;
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
  shows: [],
  hiddenFiles: [],
};

export function parseUrlState(hash: string): UrlState {
  const params = new URLSearchParams(hash.replace(/^#/, ''));
  const pair = params.getAll('pair').filter((id) => id !== '');
  const camera = (params.get('camera') ?? '').split(',').map(Number);
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
    camera: camera.length === 6 && camera.every(Number.isFinite) ? camera : null,
    isWalking: params.get('walk') === '1',
    cutM: Number(params.get('cut')) > 0 ? Number(params.get('cut')) : null,
    shows: SHOWN.filter((one) => (params.get('show') ?? '').split(',').includes(one)),
    hiddenFiles: (params.get('without') ?? '')
      .split(',')
      .filter((number) => /^\d+$/.test(number))
      .map(Number),
  };
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
  set('camera', state.camera === null ? null : state.camera.map((x) => +x.toFixed(3)).join(','));
  set('cut', state.cutM === null ? null : String(+state.cutM.toFixed(2)));
  set('show', state.shows.length === 0 ? null : state.shows.join(','));
  set('without', state.hiddenFiles.length === 0 ? null : state.hiddenFiles.join(','));
  set('walk', state.isWalking ? '1' : null);
  const text = params.toString().replaceAll('%2F', '/').replaceAll('%2C', ',');
  return text === '' ? '' : `#${text}`;
}
