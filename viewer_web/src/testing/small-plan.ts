import type { PlanJson } from '../load/plan-json.ts';

/** A plan.json of two floors and three stations, new on every call. */
export function smallPlan(): PlanJson {
  const figures = {
    achievable_area_m2: 100,
    total_area_m2: 160,
    covered_area_m2: 95,
    fraction_of_achievable: 0.95,
    fraction_of_total: 0.59375,
  };
  const station = (order: number, floor: string, z: number): PlanJson['stations'][number] => ({
    id: `S00${order}`,
    floor,
    order,
    position: [1000 + order, 2000, z],
    instrument_height_m: 1.3,
    fixed: false,
    covered_area_m2: 40,
    own_area_m2: 10 * order,
    lost_area_m2: null,
    losses: null,
  });
  return {
    schema: 'tlsplan/plan/1',
    scene: { file: 'house.ifc', georeference: null },
    scanner: { name: 'hdl-64e', range_max_m: 5 },
    requirements: { coverage: 0.95, overlap: 0.3 },
    floors: [
      { id: 'F0', name: 'Ground floor', elevation_m: 0, ground_area_m2: 70 },
      { id: 'F1', name: 'Upper floor', elevation_m: 2.8, ground_area_m2: 68 },
    ],
    stations: [station(1, 'F0', 1.3), station(2, 'F0', 1.3), station(3, 'F1', 4.1)],
    coverage: {
      ...figures,
      floors: [
        { ...figures, floor: 'F0' },
        { ...figures, floor: 'F1' },
      ],
    },
    optimality: { stations: 3, lower_bound: 2, gap: 0.3333, proven: false },
    registration: {
      threshold: 0.3,
      connected: false,
      links: [
        { a: 'S001', b: 'S002', overlap: 0.42, strength: 0.1, weak_motion: { kind: 'shift', direction: [1, 0, 0] } },
        { a: 'S002', b: 'S003', overlap: 0.08, strength: null, weak_motion: null },
      ],
      min_strength: 0,
      networks: [],
      gaps: [],
    },
    coverage_curve: [],
    route: null,
    field_time: null,
    why: null,
    site: { settled: [] },
    warnings: [],
  };
}
