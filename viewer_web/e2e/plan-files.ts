/** The plan folder that the browser tests show, read directly: the viewer's figures are compared with it. */
import { readFileSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { inflateSync } from 'node:zlib';
import { type LayersJson, parseLayers } from '../src/load/layers.ts';
import { type PlanJson, type PlanStation, parsePlan } from '../src/load/plan-json.ts';
import { readStage } from '../src/load/stage.ts';

/** A map conversion as IFC has it: the scene's x axis points 30 degrees north of east. */
const [COS, SIN] = [Math.sqrt(3) / 2, 0.5];
export const SITE_ORIGIN = [512_000, 5_412_000, 230] as const;
export const siteOf = ([x, y, z]: readonly number[]): number[] => [
  SITE_ORIGIN[0] + COS * x - SIN * y,
  SITE_ORIGIN[1] + SIN * x + COS * y,
  SITE_ORIGIN[2] + z,
];

/** The plan as it would be of a scene file with that map conversion. */
export function withSite(folder: string): object {
  const plan = JSON.parse(readFileSync(join(folder, 'plan.json'), 'utf8'));
  const [e, n, h] = SITE_ORIGIN;
  plan.scene.georeference = {
    operation: 'IfcMapConversion',
    to_map: [
      [COS, -SIN, 0, e],
      [SIN, COS, 0, n],
      [0, 0, 1, h],
      [0, 0, 0, 1],
    ],
    crs_name: 'EPSG:25832',
    crs_text: '',
    description: '',
    geodetic_datum: '',
    vertical_datum: '',
    map_projection: '',
    map_zone: '',
    map_unit: '',
    site_latitude_deg: null,
    site_longitude_deg: null,
    site_elevation_m: null,
    site_position: null,
    true_north: null,
    warnings: [],
  };
  return plan;
}

/** Begin the review of a plan folder anew: its server reads it with the next request. */
export function discardReview(folder: string): void {
  rmSync(join(folder, 'review.usda'), { force: true });
}

export class PlanFiles {
  readonly plan: PlanJson;
  /** Lowest first. */
  readonly floors: PlanJson['floors'];
  readonly ground: PlanJson['floors'][number];

  constructor(private readonly folder: string) {
    this.plan = parsePlan(JSON.parse(this.text('plan.json')));
    this.floors = [...this.plan.floors].sort((a, b) => a.elevation_m - b.elevation_m);
    this.ground = this.floors[0];
  }

  readonly stationsOf = (floorId: string): PlanStation[] => this.plan.stations.filter(({ floor }) => floor === floorId);

  get layers(): LayersJson {
    return parseLayers(JSON.parse(this.text('viewer/layers.json')));
  }

  /** Values of a layer of two bytes a patch. */
  values(file: string): Uint16Array {
    const bytes = readFileSync(join(this.folder, 'viewer', file));
    return new Uint16Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  }

  /** Returns of a station's cloud: ranges are differences along each row, two bytes a beam of three in all. */
  cloud(stationId: string): { nBeams: number; nReturns: number } {
    const bytes = inflateSync(this.bytes(`clouds/${stationId}.cloud`));
    const { cloudRows, cloudColumns } = readStage(Uint8Array.from(this.bytes('stage.usdc')).buffer).stations[0];
    const nBeams = cloudRows * cloudColumns;
    let [nReturns, range] = [0, 0];
    for (let beam = 0; beam < nBeams; beam++) {
      range = ((beam % cloudColumns === 0 ? 0 : range) + bytes.readUInt16LE(2 * beam)) % 65536;
      if (range > 0) nReturns++;
    }
    return { nBeams, nReturns };
  }

  bytes(file: string): Uint8Array {
    return readFileSync(join(this.folder, 'viewer', file));
  }

  private text(file: string): string {
    return readFileSync(join(this.folder, file), 'utf8');
  }
}
