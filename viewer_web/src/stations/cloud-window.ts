/** The part of a station's scan that is looked at: what of its beams goes to where the camera looks. */

/** azimuthRad : where it begins; it goes on counterclockwise by widthRad. low, high : elevations. */
export interface CloudWindow {
  readonly azimuthRad: number;
  readonly widthRad: number;
  readonly lowRad: number;
  readonly highRad: number;
}

type Place = readonly [number, number, number];

const TURN = 2 * Math.PI;
/** Places are looked at here and there: what lies between the outermost ones and the rim of the picture. */
const RIM_SHARE = 0.1;

/** The window from a sensor that holds all places within its range, metres; null: there are none. */
export function windowOf(sensorM: Place, places: readonly Place[], rangeM: number): CloudWindow | null {
  const beams = places
    .map(([x, y, z]) => [x - sensorM[0], y - sensorM[1], z - sensorM[2]])
    .filter((at) => Math.hypot(...at) <= rangeM && Math.hypot(...at) > 0)
    .map(([x, y, z]) => ({ azimuth: Math.atan2(y, x), elevation: Math.atan2(z, Math.hypot(x, y)) }));
  if (beams.length < 2) return null;
  const { from, width } = narrowest(beams.map(({ azimuth }) => azimuth));
  const elevations = beams.map(({ elevation }) => elevation);
  const [low, high] = [Math.min(...elevations), Math.max(...elevations)];
  const [besides, above] = [RIM_SHARE * width, RIM_SHARE * (high - low)];
  const widthRad = Math.min(TURN, width + 2 * besides);
  return {
    azimuthRad: widthRad === TURN ? 0 : from - besides,
    widthRad,
    lowRad: Math.max(-Math.PI / 2, low - above),
    highRad: Math.min(Math.PI / 2, high + above),
  };
}

/** The narrowest sector that holds all azimuths: what is left beside the widest gap between neighbours. */
function narrowest(azimuths: readonly number[]): { readonly from: number; readonly width: number } {
  const sorted = [...azimuths].sort((a, b) => a - b);
  let [from, widest] = [sorted[0], TURN - (sorted[sorted.length - 1] - sorted[0])];
  for (let i = 1; i < sorted.length; i++) {
    const gap = sorted[i] - sorted[i - 1];
    if (gap > widest) [from, widest] = [sorted[i], gap];
  }
  return { from, width: TURN - widest };
}

/** About which share of a scan's beams are in a window; elevationsRad : of its rows, the highest first. */
export function shareOfScan({ widthRad, lowRad, highRad }: CloudWindow, elevationsRad: Float32Array): number {
  const within = elevationsRad.filter((elevation) => elevation >= lowRad && elevation <= highRad).length;
  return (Math.min(TURN, widthRad) / TURN) * (within / Math.max(1, elevationsRad.length));
}
