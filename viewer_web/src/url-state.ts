/** What of the view stands in the address, so that it can be sent on: `#floor=F0&station=S003`. */

export interface UrlState {
  readonly floorId: string | null;
  readonly stationId: string | null;
}

export function parseUrlState(hash: string): UrlState {
  const params = new URLSearchParams(hash.replace(/^#/, ''));
  return { floorId: params.get('floor') || null, stationId: params.get('station') || null };
}

export function formatUrlState({ floorId, stationId }: UrlState): string {
  const params = new URLSearchParams();
  if (floorId !== null) params.set('floor', floorId);
  if (stationId !== null) params.set('station', stationId);
  const text = params.toString();
  return text === '' ? '' : `#${text}`;
}
