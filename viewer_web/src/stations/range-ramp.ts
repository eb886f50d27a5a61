/** The colours of clouds by range: dark blue over green to yellow, as the shader of cloud-points.ts has them. */
const STOPS = [
  [0.27, 0.01, 0.33],
  [0.19, 0.41, 0.56],
  [0.21, 0.72, 0.47],
  [0.99, 0.91, 0.14],
] as const;

/** Red, green, blue in 0 ... 255 at `share` 0 ... 1 of the way. */
export function rampRgb(share: number): [number, number, number] {
  const at = 3 * Math.min(1, Math.max(0, share));
  const low = Math.min(2, Math.floor(at));
  const channel = (k: 0 | 1 | 2): number => 255 * (STOPS[low][k] + (at - low) * (STOPS[low + 1][k] - STOPS[low][k]));
  return [channel(0), channel(1), channel(2)];
}

/** 256 colours of three bytes each, for legends. */
export function rampBytes(): Uint8Array {
  return Uint8Array.from({ length: 3 * 256 }, (_, i) => Math.round(rampRgb(Math.floor(i / 3) / 255)[i % 3]));
}
