import { type PlanJson, parsePlan, type RequirementResult } from '../load/plan-json.ts';

/** A plan.json of two floors and three stations with what every version writes, new on every call. */
export function smallPlan(): PlanJson {
  const figures = {
    achievable_area_m2: 100,
    total_area_m2: 160,
    covered_area_m2: 95,
    fraction_of_achievable: 0.95,
    fraction_of_total: 0.59375,
  };
  const station = (order: number, floor: string, z: number) => ({
    id: `S00${order}`,
    floor,
    order,
    position: [1000 + order, 2000, z],
    instrument_height_m: 1.3,
    fixed: false,
    covered_area_m2: 40,
    own_area_m2: 10 * order,
  });
  const floor = (id: string, name: string, elevation_m: number, ground_area_m2: number) => {
    const bounds = [
      [1000, 2000],
      [1010, 2007],
    ];
    return { id, name, elevation_m, ground_area_m2, bounds, origin: 'slab', n_stations: 2 };
  };
  const none = { faces_read: 60, non_finite: 0, degenerate: 0, duplicate: 0, bad_index: 0 };
  return parsePlan({
    schema: 'tlsplan/plan/1',
    scene: {
      file: 'house.ifc',
      sha256: '0'.repeat(64),
      format: 'ifc',
      schema: 'IFC2X3',
      units: 'metre',
      metres_per_unit: 1,
      up_axis: 'Z',
      offset: [1000, 2000, 0],
      n_elements: 5,
      n_triangles: 60,
      repairs: { ...none, dropped: [], warnings: [] },
    },
    scanner: {
      name: 'hdl-64e',
      title: 'Velodyne HDL-64E',
      source: 'its manual',
      range_min_m: 0.5,
      range_max_m: 5,
      n_azimuths: 360,
      n_channels: 2,
      elevation_rad: [0.5, -0.5],
      instrument_height_min_m: 1.2,
      instrument_height_max_m: 1.9,
    },
    requirements: { coverage: 0.95, overlap: 0.3, floors: [] },
    method: 'greedy',
    seed: 0,
    settings: {
      grid_step_m: 0.5,
      instrument_heights_m: [],
      height_step_m: 0.4,
      clearance_m: 0.4,
      ground_ring_radius_m: 0.2,
      n_ground_ring_rays: 16,
      max_patch_area_m2: 0.04,
      n_candidates: 90,
      n_patches: 5000,
    },
    floors: [floor('F0', 'Ground floor', 0, 70), floor('F1', 'Upper floor', 2.8, 68)],
    stations: [station(1, 'F0', 1.3), station(2, 'F0', 1.3), station(3, 'F1', 4.1)],
    coverage: {
      ...figures,
      max_patch_area_m2: 0.04,
      floors: [
        { ...figures, floor: 'F0' },
        { ...figures, floor: 'F1' },
      ],
    },
    coverage_curve: [],
    optimality: { objective: 'fewest stations', stations: 3, lower_bound: 2, gap: 0.3333, proven: false },
    registration: {
      threshold: 0.3,
      connected: false,
      links: [
        { a: 'S001', b: 'S002', overlap: 0.42, strength: 0.1, weak_motion: { kind: 'shift', direction: [1, 0, 0] } },
        { a: 'S002', b: 'S003', overlap: 0.08, strength: null, weak_motion: null },
      ],
    },
    unseen: [],
    warnings: [],
    device: 'a processor',
    versions: {},
    timings_s: {},
  });
}

/** How far a requirement is met, with all that plan.json says of it. */
export function resultOf(result: RequirementResult): PlanJson['requirements']['results'][number] {
  const { asked } = smallPlan().requirements;
  return {
    as_set_up: null,
    ...result,
    seen_from: 1,
    asked,
    achievable_area_m2: 100,
    covered_area_m2: 90,
    total_area_m2: 160,
  };
}
