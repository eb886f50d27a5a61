/** plan.json as far as the viewer reads it; what it does not read may be there in any form. */
import * as v from 'valibot';
import { PlanLoadError } from './plan-load-error.ts';

const SCHEMA = 'tlsplan/plan/1';
const fraction = v.number();
const area = v.pipe(v.number(), v.minValue(0));

const CoverageFigures = v.object({
  achievable_area_m2: area,
  total_area_m2: area,
  covered_area_m2: area,
  fraction_of_achievable: fraction,
  fraction_of_total: fraction,
});

const point = v.tuple([v.number(), v.number(), v.number()]);
const Room = v.nullable(v.object({ name: v.string() }));

const WeakMotion = v.object({ kind: v.picklist(['shift', 'turn']), direction: point });

const Link = v.object({
  a: v.string(),
  b: v.string(),
  overlap: fraction,
  strength: v.nullable(v.number()),
  /** The motion that the link holds least; missing in plans of older versions. */
  weak_motion: v.optional(v.nullable(WeakMotion), null),
});

const Network = v.object({
  stations: v.array(v.string()),
  floors: v.array(v.string()),
  n_links: v.number(),
  bridges: v.array(v.tuple([v.string(), v.string()])),
  articulations: v.array(v.string()),
  bottleneck: v.nullable(Link),
  two_connected: v.boolean(),
});

const UnseenSurface = v.object({
  /** Index in the scene's list of elements. */
  element: v.number(),
  name: v.string(),
  kind: v.string(),
  room: Room,
  floor: v.string(),
  reason: v.string(),
  area_m2: area,
  n_pieces: v.number(),
  pieces: v.array(v.object({ area_m2: area, centroid: point, box: v.tuple([point, point]), patch: v.number() })),
  best_spot: v.nullable(v.object({ position: point, sees_m2: area, adds_m2: area })),
});

const Why = v.object({
  stations: v.array(
    v.object({
      station: v.string(),
      own_parts: v.array(v.object({ name: v.string(), room: Room, area_m2: area })),
    }),
  ),
  curve: v.array(
    v.object({ station: v.string(), covered_area_m2: area, fraction_of_achievable: v.nullable(fraction) }),
  ),
  unseen_surfaces: v.array(UnseenSurface),
});

const Route = v.object({
  length_m: v.number(),
  returns: v.boolean(),
  order: v.array(v.string()),
  left_out: v.array(v.string()),
  legs: v.array(
    v.object({
      from: v.nullable(v.string()),
      to: v.nullable(v.string()),
      length_m: v.nullable(v.number()),
      floors: v.array(v.string()),
      points: v.array(point),
    }),
  ),
});

const limit = v.nullable(v.number());
const Asked = v.object({ spacing_m: limit, range_m: limit, incidence_rad: limit, noise_m: limit });

/** How far one part of what was asked is met: a floor, a class, a zone, or all of it. */
const RequirementResult = v.object({
  name: v.string(),
  required: fraction,
  fraction_of_achievable: fraction,
  met: v.boolean(),
});

/** What a requirement, by its name in the results, would lose without a station. */
const StationLoss = v.object({
  requirement: v.string(),
  area_m2: area,
  fraction_of_achievable: fraction,
  met: v.boolean(),
});

const seconds = v.nullable(v.number());

/** Rows from the scene's coordinates to the map's; null: the file does not say. */
const MapRows = v.nullable(v.array(v.array(v.number())));
const Georeference = v.nullable(v.object({ to_map: MapRows }));

const PlanJson = v.object({
  schema: v.literal(SCHEMA),
  scene: v.object({ file: v.string(), georeference: v.optional(Georeference, null) }),
  scanner: v.object({
    name: v.string(),
    title: v.optional(v.string()),
    range_max_m: v.number(),
    instrument_height_min_m: v.optional(v.number()),
    instrument_height_max_m: v.optional(v.number()),
  }),
  requirements: v.object({
    coverage: fraction,
    overlap: fraction,
    seen_from: v.optional(v.number()),
    network: v.optional(v.string()),
    floors: v.optional(v.array(v.string())),
    asked: v.optional(Asked),
    parts: v.optional(v.array(v.object({ name: v.string() }))),
    results: v.optional(v.array(RequirementResult)),
  }),
  floors: v.array(
    v.object({ id: v.string(), name: v.string(), elevation_m: v.number(), ground_area_m2: v.nullable(v.number()) }),
  ),
  stations: v.array(
    v.object({
      id: v.string(),
      floor: v.string(),
      order: v.number(),
      position: point,
      instrument_height_m: v.number(),
      fixed: v.boolean(),
      covered_area_m2: area,
      own_area_m2: area,
      /** Null: an older version made the plan. */
      lost_area_m2: v.optional(v.nullable(area), null),
      losses: v.optional(v.nullable(v.array(StationLoss)), null),
    }),
  ),
  coverage: v.object({
    ...CoverageFigures.entries,
    floors: v.array(v.object({ ...CoverageFigures.entries, floor: v.string() })),
  }),
  optimality: v.object({
    stations: v.number(),
    lower_bound: v.nullable(v.number()),
    gap: v.nullable(v.number()),
    proven: v.boolean(),
  }),
  registration: v.object({
    threshold: fraction,
    connected: v.boolean(),
    links: v.array(Link),
    min_strength: v.optional(v.nullable(v.number()), 0),
    networks: v.optional(v.array(Network), []),
    gaps: v.optional(v.array(v.object({ networks: v.array(v.number()), best: Link })), []),
  }),
  coverage_curve: v.optional(v.array(v.nullable(fraction)), []),
  route: v.optional(v.nullable(Route), null),
  field_time: v.optional(
    v.nullable(v.object({ scanning_s: seconds, set_up_s: seconds, walking_s: seconds, total_s: seconds })),
    null,
  ),
  why: v.optional(v.nullable(Why), null),
  site: v.optional(v.object({ settled: v.optional(v.array(v.object({ id: v.string(), role: v.string() })), []) }), {}),
  warnings: v.optional(v.array(v.string()), []),
});

export type PlanJson = v.InferOutput<typeof PlanJson>;
export type PlanStation = PlanJson['stations'][number];
export type PlanFloor = PlanJson['floors'][number];
export type RequirementResult = v.InferOutput<typeof RequirementResult>;
export type StationLoss = v.InferOutput<typeof StationLoss>;
export type WeakMotion = v.InferOutput<typeof WeakMotion>;
export type PlanLink = v.InferOutput<typeof Link>;
export type PlanNetwork = v.InferOutput<typeof Network>;
export type UnseenSurface = v.InferOutput<typeof UnseenSurface>;
export type PlanRoute = v.InferOutput<typeof Route>;

/** Check a parsed plan.json; the error names the first key that does not fit. */
export function parsePlan(json: unknown): PlanJson {
  const result = v.safeParse(PlanJson, json);
  if (result.success) return result.output;
  const issue = result.issues[0];
  const key = v.getDotPath(issue) ?? 'the whole file';
  if (key === 'schema') {
    throw new PlanLoadError(
      `plan.json: schema is ${issue.received}, expected "${SCHEMA}". Write the plan again with this version of tlsplan.`,
    );
  }
  throw new PlanLoadError(
    `plan.json: ${key} is ${issue.received}, expected ${issue.expected}. Write the plan again with \`tlsplan plan\`.`,
  );
}
