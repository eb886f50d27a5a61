/**
 * A station's cloud as the picture one would have from there: azimuths from left to right as one turns to the right, elevations
 * upright. Pixels look up the beam nearest to their direction.
 */
import type { Beams } from '../load/cloud.ts';
import type { ThinnedCloud } from '../load/cloud-rows.ts';

export interface PanoramaFrame {
  readonly width: number;
  readonly height: number;
  /** Azimuth of the left edge; it falls to the right. */
  readonly leftRad: number;
  readonly spanRad: number;
  readonly topRad: number;
  readonly bottomRad: number;
}

/** The frame that holds all beams, as many pixels wide; a pixel is as high as it is wide. */
export function frameOf(beams: Beams, width: number): PanoramaFrame {
  const spanRad = Math.min(2 * Math.PI, beams.columns * beams.azimuthStepRad);
  const first = Math.min(...beams.azimuthsRad);
  const elevations = [...beams.elevationsRad];
  const [topRad, bottomRad] = [Math.max(...elevations), Math.min(...elevations)];
  const height = Math.max(1, Math.round((width * (topRad - bottomRad)) / spanRad));
  return { width, height, leftRad: first + spanRad, spanRad, topRad, bottomRad };
}

export interface Direction {
  readonly azimuthRad: number;
  readonly elevationRad: number;
}

export function directionAt(frame: PanoramaFrame, x: number, y: number): Direction {
  return {
    azimuthRad: frame.leftRad - ((x + 0.5) / frame.width) * frame.spanRad,
    elevationRad: frame.topRad - ((y + 0.5) / frame.height) * (frame.topRad - frame.bottomRad),
  };
}

/** Looks up beams by direction; rows are sorted once. */
export class BeamFinder {
  /** Rows by elevation, lowest first. */
  private readonly order: number[];

  constructor(private readonly beams: Beams) {
    const { elevationsRad } = beams;
    this.order = [...elevationsRad.keys()].sort((a, b) => elevationsRad[a] - elevationsRad[b]);
  }

  /** Number of the beam nearest to a direction; -1: there is none in it. */
  beamAt({ azimuthRad, elevationRad }: Direction): number {
    const { columns, azimuthsRad, azimuthStepRad } = this.beams;
    const row = this.rowAt(elevationRad);
    const turns = (azimuthRad - azimuthsRad[row]) / (2 * Math.PI);
    const beyondRad = (turns - Math.floor(turns)) * 2 * Math.PI;
    // A little before the first beam is a whole turn beyond it.
    const isFirst = 2 * Math.PI - beyondRad < azimuthStepRad / 2;
    const column = isFirst ? 0 : Math.round(beyondRad / azimuthStepRad);
    return column < columns ? row * columns + column : -1;
  }

  private rowAt(elevationRad: number): number {
    const { elevationsRad } = this.beams;
    let [low, high] = [0, this.order.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (elevationsRad[this.order[middle]] < elevationRad) low = middle + 1;
      else high = middle;
    }
    const [above, below] = [this.order[low], this.order[Math.max(0, low - 1)]];
    const isAbove = Math.abs(elevationsRad[above] - elevationRad) <= Math.abs(elevationsRad[below] - elevationRad);
    return isAbove ? above : below;
  }
}

/** Colour of a return: red, green, blue in 0 ... 255. */
export type BeamColor = (rangeM: number, intensity: number) => readonly [number, number, number];

/** Four bytes a pixel; transparent where no return is. */
export function panoramaPixels({ cloud, beams }: ThinnedCloud, frame: PanoramaFrame, color: BeamColor) {
  const pixels = new Uint8ClampedArray(4 * frame.width * frame.height);
  const finder = new BeamFinder(beams);
  for (let y = 0; y < frame.height; y++) {
    for (let x = 0; x < frame.width; x++) {
      const beam = finder.beamAt(directionAt(frame, x, y));
      const steps = beam < 0 ? 0 : cloud.rangeSteps[beam];
      if (steps === 0) continue;
      const at = 4 * (y * frame.width + x);
      pixels.set(color(steps * beams.rangeStepM, cloud.intensity[beam] / 255), at);
      pixels[at + 3] = 255;
    }
  }
  return pixels;
}
