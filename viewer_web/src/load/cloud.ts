/** The cloud of one station, viewer/clouds/*.u16: ranges and intensities of all beams, as docs/formats/stage.md has them. */
import { PlanLoadError } from './plan-load-error.ts';
import type { StageStation } from './stage.ts';

export interface Cloud {
  /** Rows x columns, row by row from the highest elevation; steps of `StageStation.rangeStepM`; 0: no return. */
  readonly rangeSteps: Uint16Array;
  /** Rows x columns, 255 x |cos incidence|. */
  readonly intensity: Uint8Array;
  readonly nReturns: number;
}

/** Split the file's bytes; throws where their number is not that of the station's beams. */
export function decodeCloud(buffer: ArrayBuffer, station: StageStation): Cloud {
  const nBeams = station.cloudRows * station.cloudColumns;
  if (buffer.byteLength !== 3 * nBeams) {
    throw new PlanLoadError(
      `viewer/${station.cloudUri}: ${buffer.byteLength} bytes, expected ${3 * nBeams} for ${station.cloudRows} x ` +
        `${station.cloudColumns} beams. Write the plan again with \`tlsplan plan\`.`,
    );
  }
  // Little endian, as every machine that runs a browser.
  const rangeSteps = new Uint16Array(buffer, 0, nBeams);
  let nReturns = 0;
  for (const steps of rangeSteps) if (steps > 0) nReturns++;
  return { rangeSteps, intensity: new Uint8Array(buffer, 2 * nBeams, nBeams), nReturns };
}

/** Where beam (row, column) met a surface, relative to the sensor, metres; null without a return. */
export function cloudPoint(
  cloud: Cloud,
  station: StageStation,
  row: number,
  column: number,
): [number, number, number] | null {
  const steps = cloud.rangeSteps[row * station.cloudColumns + column];
  if (steps === 0) return null;
  const range = steps * station.rangeStepM;
  const elevation = station.elevationsRad[row];
  const azimuth = station.azimuthsRad[row] + column * station.azimuthStepRad;
  const flat = range * Math.cos(elevation);
  return [flat * Math.cos(azimuth), flat * Math.sin(azimuth), range * Math.sin(elevation)];
}
