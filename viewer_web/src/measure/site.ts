/** Site coordinates: easting, northing and height, as the scene file's map conversion gives them. */
import { decimal, separator, t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import { FOOT_M, units } from '../panels/units.ts';
import type { PointM } from './geometry.ts';

/** The foot of surveys in the USA: at eastings of millions 2 millionths are metres. */
const SURVEY_FOOT_M = 1200 / 3937;

export interface Site {
  /** Of the coordinate reference system; empty: not told. */
  readonly name: string;
  toSite(sceneM: PointM): PointM;
  toScene(siteM: PointM): PointM;
  /** Direction of grid north in the plan of the scene, clockwise from its +y. */
  readonly northRad: number;
  /** Metres of the foot that site coordinates in feet are in. */
  readonly footM: number;
}

type Georeferenced = Pick<PlanJson['scene'], 'georeference'>;

/** Null: the plan knows no map conversion, and scene coordinates are all there is. */
export function siteOf({ georeference }: Georeferenced): Site | null {
  const rows = georeference?.to_map;
  if (!georeference || !rows) return null;
  const matrix = rows.slice(0, 3).map((row) => row.slice(0, 3));
  const shift = rows.slice(0, 3).map((row) => row[3]);
  const back = inverse(matrix);
  const north = times(back, [0, 1, 0]);
  return {
    name: georeference.crs_name,
    toSite: (sceneM) => times(matrix, sceneM).map((x, k) => x + shift[k]) as unknown as PointM,
    // The shift goes first: with northings of millions it would eat the digits of the product.
    toScene: (siteM) => times(back, siteM.map((x, k) => x - shift[k]) as unknown as PointM),
    northRad: Math.atan2(north[0], north[1]),
    footM: /survey/i.test(georeference.map_unit) ? SURVEY_FOOT_M : FOOT_M,
  };
}

/** Which way north is in the plan of the scene, clockwise from its +y, and which north that is. */
export function northOf(scene: Georeferenced): {
  readonly rad: number;
  readonly name: string;
  readonly isGiven: boolean;
} {
  const site = siteOf(scene);
  if (site !== null) return { rad: site.northRad, name: t('Grid north'), isGiven: true };
  const told = scene.georeference?.true_north;
  if (told) return { rad: Math.atan2(told[0], told[1]), name: t('True north'), isGiven: true };
  return { rad: 0, name: t('+y; north not given'), isGiven: false };
}

/** How many metres the unit is that site coordinates are read and written in. */
export const siteUnitM = (site: Site): number => (units.value === 'm' ? 1 : site.footM);

/** "E 512345.678, N 5412345.678, H 230.000" in the chosen unit. */
export function siteWords(site: Site, sceneM: PointM): string {
  const unitM = siteUnitM(site);
  const digits = units.value === 'm' ? 3 : 2;
  return site
    .toSite(sceneM)
    .map((value, k) => `${'ENH'[k]} ${decimal(value / unitM, digits)}`)
    .join(separator);
}

function times(rows: readonly (readonly number[])[], [x, y, z]: PointM): PointM {
  return rows.map(([a, b, c]) => a * x + b * y + c * z) as unknown as PointM;
}

/** Of three rows, by cofactors. */
function inverse([[a, b, c], [d, e, f], [g, h, i]]: readonly (readonly number[])[]): number[][] {
  const [A, B, C] = [e * i - f * h, f * g - d * i, d * h - e * g];
  const det = a * A + b * B + c * C;
  return [
    [A, c * h - b * i, b * f - c * e],
    [B, a * i - c * g, c * d - a * f],
    [C, b * g - a * h, a * e - b * d],
  ].map((row) => row.map((x) => x / det));
}
