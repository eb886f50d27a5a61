/** Reads a station's cloud piece by piece, keeping some rows and columns: the file may be larger than memory allows. */
import { t } from '../language/language.ts';
import type { Beams, Cloud } from './cloud.ts';
import { PlanLoadError } from './plan-load-error.ts';
import type { StageStation } from './stage.ts';

export interface ThinnedCloud {
  readonly cloud: Cloud;
  readonly beams: Beams;
}

/** Every so many rows and columns of a cloud are kept. */
export interface Thinning {
  readonly everyRow: number;
  readonly everyColumn: number;
}

export const ALL_BEAMS: Thinning = { everyRow: 1, everyColumn: 1 };

/** The angles that remain of a station's beams. */
export function thinnedBeams(station: StageStation, { everyRow, everyColumn }: Thinning): Beams {
  const every = (angles: Float32Array): Float32Array => angles.filter((_, row) => row % everyRow === 0);
  return {
    rows: Math.ceil(station.cloudRows / everyRow),
    columns: Math.ceil(station.cloudColumns / everyColumn),
    rangeStepM: station.rangeStepM,
    elevationsRad: every(station.elevationsRad),
    azimuthsRad: every(station.azimuthsRad),
    azimuthStepRad: station.azimuthStepRad * everyColumn,
  };
}

/** The least thinning at which `nClouds` clouds together stay within a number of points: columns and rows in turn. */
export function thinningFor({ cloudRows, cloudColumns }: StageStation, nClouds: number, budget: number): Thinning {
  let [everyRow, everyColumn] = [1, 1];
  while (nClouds * Math.ceil(cloudRows / everyRow) * Math.ceil(cloudColumns / everyColumn) > budget) {
    if (everyColumn <= everyRow) everyColumn++;
    else everyRow++;
  }
  return { everyRow, everyColumn };
}

/** The cloud in a file's body, packed or as older plans have it. */
export async function readCloud(
  body: ReadableStream<Uint8Array<ArrayBuffer>>,
  station: StageStation,
  thinning: Thinning,
  isPacked: boolean,
): Promise<ThinnedCloud> {
  const rows = new CloudRows(station, thinning, isPacked);
  const reader = (isPacked ? body.pipeThrough(new DecompressionStream('deflate')) : body).getReader();
  try {
    for (let step = await reader.read(); !step.done; step = await reader.read()) rows.push(step.value);
  } catch (error) {
    if ((error as Error).name === 'AbortError') throw error;
    const file = `viewer/${station.cloudUri}`;
    throw new PlanLoadError(
      t('{file}: damaged, or the connection broke. Load the page again, or write the plan again.', { file }),
    );
  }
  return rows.finish();
}

/** Takes the bytes of a cloud in pieces of any length. `isDifferences`: of each row the first value, and how much the others change. */
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
    private readonly thinning: Thinning,
    private readonly isDifferences = false,
  ) {
    this.beams = thinnedBeams(station, thinning);
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
        t(
          '{file}: {n} bytes, expected {expected} for {rows} x {columns} beams. Write the plan again with `tlsplan plan`.',
          {
            file: `viewer/${cloudUri}`,
            n: this.nBytes,
            expected,
            rows: cloudRows,
            columns: cloudColumns,
          },
        ),
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
    const { station, beams } = this;
    const { everyRow, everyColumn } = this.thinning;
    const isRanges = this.nRows < station.cloudRows;
    const row = isRanges ? this.nRows : this.nRows - station.cloudRows;
    if (row % everyRow === 0) {
      const first = (row / everyRow) * beams.columns;
      // Little endian, as every machine that runs a browser.
      const values = isRanges ? new Uint16Array(this.row.buffer) : this.row;
      const to = isRanges ? this.rangeSteps : this.intensity;
      if (this.isDifferences)
        for (let column = 1; column < station.cloudColumns; column++) values[column] += values[column - 1];
      for (let column = 0; column < beams.columns; column++) to[first + column] = values[column * everyColumn];
    }
    this.nRows++;
    this.inRow = 0;
  }
}
