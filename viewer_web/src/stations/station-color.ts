/** A colour of its own for each station's cloud: hues a golden angle apart, so that neighbours in order differ most. */

const GOLDEN_ANGLE_DEG = 137.508;

/** Red, green, blue in 0 ... 1. */
export function stationColor(order: number): [number, number, number] {
  const hue = (order * GOLDEN_ANGLE_DEG) % 360;
  // Lightness goes round too: not everybody tells hues apart.
  const lightness = [0.5, 0.62, 0.42][order % 3];
  const chroma = 0.75 * (1 - Math.abs(2 * lightness - 1));
  const channel = (shift: number): number => {
    const at = (shift + hue / 30) % 12;
    return lightness - (chroma / 2) * Math.max(-1, Math.min(at - 3, 9 - at, 1));
  };
  return [channel(0), channel(8), channel(4)];
}

export function cssColor([r, g, b]: readonly number[]): string {
  return `rgb(${[r, g, b].map((x) => Math.round(255 * x)).join(' ')})`;
}
