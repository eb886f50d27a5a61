/** Which stations see a place on a surface: from how far, how obliquely, whether as required, and which samples it most closely. */
import { t } from '../language/language.ts';
import type { PlanJson } from '../load/plan-json.ts';
import type { PointM } from '../measure/geometry.ts';

export type Limits = PlanJson['requirements']['asked'];

export interface Sight {
  readonly stationId: string;
  readonly rangeM: number;
  /** Between the beam and the surface's normal, 0 ... pi / 2. */
  readonly incidenceRad: number;
  readonly isBest: boolean;
  /** Why it is not counted; null: it sees the surface as required. */
  readonly shortfall: string | null;
}

interface Seeing {
  readonly id: string;
  readonly positionM: PointM;
  /** Whether it sees the surface within the limits required, as the plan counts stations. */
  readonly isCounted: boolean;
}

type Place = Pick<Sight, 'rangeM' | 'incidenceRad'>;

/** Limits are of a patch, the figures of a point in it: where both keep to theirs, it is a limit that a point doesn’t show. */
function shortfallOf({ rangeM, incidenceRad }: Place, limits: Limits): string {
  if (limits.incidence_rad !== null && incidenceRad > limits.incidence_rad) return t('too oblique');
  if (limits.range_m !== null && rangeM > limits.range_m) return t('out of range');
  if (limits.spacing_m !== null && limits.noise_m === null) return t('too sparse');
  if (limits.noise_m !== null && limits.spacing_m === null) return t('too noisy');
  return t('not as required');
}

/**
 * Of stations that see it, those that are counted first, best first. Points of one scanner are range / cos(incidence) times its angular step apart, along the surface
 * as the beam crosses it: the counted station with the least of that is the best.
 */
export function sightsOf(stations: readonly Seeing[], atM: PointM, normal: PointM, limits: Limits): Sight[] {
  const length = Math.hypot(...normal);
  const sights = stations.map(({ id, positionM, isCounted }) => {
    const beam = positionM.map((x, k) => x - atM[k]);
    const rangeM = Math.hypot(...beam);
    const cos = Math.min(1, Math.abs(beam.reduce((sum, x, k) => sum + x * normal[k], 0)) / (rangeM * length));
    const place = { rangeM, incidenceRad: Math.acos(cos) };
    const shortfall = isCounted ? null : shortfallOf(place, limits);
    return { stationId: id, ...place, shortfall, spacing: rangeM / Math.max(cos, 1e-6) };
  });
  sights.sort((a, b) => Number(a.shortfall !== null) - Number(b.shortfall !== null) || a.spacing - b.spacing);
  return sights.map(({ spacing: _, ...sight }, i) => ({ ...sight, isBest: i === 0 && sight.shortfall === null }));
}
