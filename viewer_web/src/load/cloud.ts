/** The cloud of one station, viewer/clouds: ranges and intensities of all beams, as docs/formats/stage.md has them. */

/** The angles of a cloud's beams. */
export interface Beams {
  readonly rows: number;
  readonly columns: number;
  readonly rangeStepM: number;
  /** One a row. */
  readonly elevationsRad: Float32Array;
  /** Of each row's first beam; the next column is `azimuthStepRad` on. */
  readonly azimuthsRad: Float32Array;
  readonly azimuthStepRad: number;
}

export interface Cloud {
  /** Rows x columns, row by row from the highest elevation; steps of `Beams.rangeStepM`; 0: no return. */
  readonly rangeSteps: Uint16Array;
  /** Rows x columns, 255 x |cos incidence|. */
  readonly intensity: Uint8Array;
  readonly nReturns: number;
}

/** Where beam (row, column) met a surface, relative to the sensor, metres; null without a return. */
export function cloudPoint(cloud: Cloud, beams: Beams, row: number, column: number): [number, number, number] | null {
  const steps = cloud.rangeSteps[row * beams.columns + column];
  if (steps === 0) return null;
  const range = steps * beams.rangeStepM;
  const elevation = beams.elevationsRad[row];
  const azimuth = beams.azimuthsRad[row] + column * beams.azimuthStepRad;
  const flat = range * Math.cos(elevation);
  return [flat * Math.cos(azimuth), flat * Math.sin(azimuth), range * Math.sin(elevation)];
}
