/** Which stations see a place on a surface: from how far, how obliquely, and which of them samples it most closely. */
import type { PointM } from '../measure/geometry.ts';

export interface Sight {
  readonly stationId: string;
  readonly rangeM: number;
  /** Between the beam and the surface's normal, 0 ... pi / 2. */
  readonly incidenceRad: number;
  readonly isBest: boolean;
}

interface Seeing {
  readonly id: string;
  readonly positionM: PointM;
}

/**
 * Of stations that see it, best first. Points of one scanner are range / cos(incidence) times its angular step apart, along the surface
 * as the beam crosses it: the station with the least of that is the best.
 */
export function sightsOf(stations: readonly Seeing[], atM: PointM, normal: PointM): Sight[] {
  const length = Math.hypot(...normal);
  const sights = stations.map(({ id, positionM }) => {
    const beam = positionM.map((x, k) => x - atM[k]);
    const rangeM = Math.hypot(...beam);
    const cos = Math.min(1, Math.abs(beam.reduce((sum, x, k) => sum + x * normal[k], 0)) / (rangeM * length));
    return { stationId: id, rangeM, incidenceRad: Math.acos(cos), spacing: rangeM / Math.max(cos, 1e-6) };
  });
  sights.sort((a, b) => a.spacing - b.spacing);
  return sights.map(({ spacing: _, ...sight }, i) => ({ ...sight, isBest: i === 0 }));
}
