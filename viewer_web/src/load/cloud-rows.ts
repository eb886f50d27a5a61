/** Reads a station's cloud piece by piece, keeping every nth row and column: the file may be larger than memory allows. */
import type { Beams, Cloud } from './cloud.ts';
import { PlanLoadError } from './plan-load-error.ts';
import type { StageStation } from './stage.ts';

export interface ThinnedCloud {
  readonly cloud: Cloud;
  readonly beams: Beams;
}

/** The angles that remain of a station's beams. */
export function thinnedBeams(station: StageStation, stride: number): Beams {
  const every = (angles: Float32Array): Float32Array => angles.filter((_, row) => row % stride === 0);
  return {
    rows: Math.ceil(station.cloudRows / stride),
    columns: Math.ceil(station.cloudColumns / stride),
    rangeStepM: station.rangeStepM,
    elevationsRad: every(station.elevationsRad),
    azimuthsRad: every(station.azimuthsRad),
    azimuthStepRad: station.azimuthStepRad * stride,
  };
}

/** The smallest stride at which `nClouds` clouds together stay within a number of points. */
export function strideFor({ cloudRows, cloudColumns }: StageStation, nClouds: number, budget: number): number {
  let stride = 1;
  while (nClouds * Math.ceil(cloudRows / stride) * Math.ceil(cloudColumns / stride) > budget) stride++;
  return stride;
}

/** Takes the bytes of a cloud's file in pieces of any length. */
export class CloudRows {
  private readonly beams: Beams;
  private readonly rangeSteps: Uint16Array<ArrayBuffer>;
  private readonly intensity: Uint8Array<ArrayBuffer>;
  /** The row that is being read, of two bytes a beam first and of one afterwards. */
  private readonly row: Uint8Array<ArrayBuffer>;
  private inRow = 0;
  private nRows = 0;
  private nBytes = 0;

  constructor(
    private readonly station: StageStation,
    private readonly stride: number,
  ) {
    this.beams = thinnedBeams(station, stride);
    const n = this.beams.rows * this.beams.columns;
    this.rangeSteps = new Uint16Array(n);
    this.intensity = new Uint8Array(n);
    this.row = new Uint8Array(2 * station.cloudColumns);
  }

  push(bytes: Uint8Array): void {
    this.nBytes += bytes.length;
    let at = 0;
    while (at < bytes.length && this.nRows < 2 * this.station.cloudRows) {
      const wanted = this.rowBytes - this.inRow;
      const part = bytes.subarray(at, at + wanted);
      this.row.set(part, this.inRow);
      this.inRow += part.length;
      at += part.length;
      if (this.inRow === this.rowBytes) this.endRow();
    }
  }

  /** The cloud; throws where the bytes were not those of the station's beams. */
  finish(): ThinnedCloud {
    const { cloudRows, cloudColumns, cloudUri } = this.station;
    const expected = 3 * cloudRows * cloudColumns;
    if (this.nBytes !== expected) {
      throw new PlanLoadError(
        `viewer/${cloudUri}: ${this.nBytes} bytes, expected ${expected} for ${cloudRows} x ${cloudColumns} beams. ` +
          'Write the plan again with `tlsplan plan`.',
      );
    }
    let nReturns = 0;
    for (const steps of this.rangeSteps) if (steps > 0) nReturns++;
    return { cloud: { rangeSteps: this.rangeSteps, intensity: this.intensity, nReturns }, beams: this.beams };
  }

  /** Ranges of all rows come before intensities of all rows. */
  private get rowBytes(): number {
    return this.nRows < this.station.cloudRows ? 2 * this.station.cloudColumns : this.station.cloudColumns;
  }

  private endRow(): void {
    const { stride, station, beams } = this;
    const isRanges = this.nRows < station.cloudRows;
    const row = isRanges ? this.nRows : this.nRows - station.cloudRows;
    if (row % stride === 0) {
      const first = (row / stride) * beams.columns;
      // Little endian, as every machine that runs a browser.
      const values = isRanges ? new Uint16Array(this.row.buffer) : this.row;
      const to = isRanges ? this.rangeSteps : this.intensity;
      for (let column = 0; column < beams.columns; column++) to[first + column] = values[column * stride];
    }
    this.nRows++;
    this.inRow = 0;
  }
}
