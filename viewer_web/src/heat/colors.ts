/** Colours of layers as the building's shader takes them: 256 of three bytes each. */
import type { ClassLayer, HeatLayer, ThemedColor } from './layers.ts';

type Rgb = readonly [number, number, number];

export function themed(color: ThemedColor, isDark: boolean): string {
  return typeof color === 'string' ? color : isDark ? color.dark : color.light;
}

export function rgbOf(hex: string): Rgb {
  const number = Number.parseInt(hex.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}

/** By value. A value without a class of its own has the colour of the next lower one that has one: "4+" is 4 and more. */
export function classColors({ classes }: ClassLayer, isDark: boolean): Uint8Array {
  const colors = new Uint8Array(3 * 256);
  const byValue = new Map(classes.map(({ value, color }) => [value, rgbOf(themed(color, isDark))]));
  let last: Rgb = [0, 0, 0];
  for (let value = 0; value < 256; value++) {
    last = byValue.get(value) ?? last;
    colors.set(last, 3 * value);
  }
  return colors;
}

/** Pale yellow over green to deep blue: good is pale, bad is deep, and lightness alone tells them apart. */
const STOPS: readonly Rgb[] = ['#f3eec0', '#a9d79f', '#55b3a6', '#2f81a6', '#33508f', '#3a2560'].map(rgbOf);

/** From the lowest to the highest value. */
export function rampColors(better: 'low' | 'high'): Uint8Array {
  const colors = new Uint8Array(3 * 256);
  for (let i = 0; i < 256; i++) {
    const share = (better === 'low' ? i : 255 - i) / 255;
    const at = Math.min(STOPS.length - 2, Math.floor(share * (STOPS.length - 1)));
    const within = share * (STOPS.length - 1) - at;
    for (let k = 0; k < 3; k++) {
      colors[3 * i + k] = Math.round(STOPS[at][k] + within * (STOPS[at + 1][k] - STOPS[at][k]));
    }
  }
  return colors;
}

export function layerColors(layer: HeatLayer, isDark: boolean): Uint8Array {
  return layer.kind === 'classes' ? classColors(layer, isDark) : rampColors(layer.better);
}
