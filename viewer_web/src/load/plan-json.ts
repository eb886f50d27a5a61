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

const PlanJson = v.object({
  schema: v.literal(SCHEMA),
  scene: v.object({ file: v.string() }),
  scanner: v.object({ name: v.string(), title: v.optional(v.string()), range_max_m: v.number() }),
  requirements: v.object({ coverage: fraction, overlap: fraction }),
  floors: v.array(
    v.object({ id: v.string(), name: v.string(), elevation_m: v.number(), ground_area_m2: v.nullable(v.number()) }),
  ),
  stations: v.array(
    v.object({
      id: v.string(),
      floor: v.string(),
      order: v.number(),
      position: v.tuple([v.number(), v.number(), v.number()]),
      instrument_height_m: v.number(),
      fixed: v.boolean(),
      covered_area_m2: area,
      own_area_m2: area,
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
    links: v.array(v.object({ a: v.string(), b: v.string(), overlap: fraction, strength: v.nullable(v.number()) })),
  }),
  unseen: v.optional(
    v.array(
      v.object({
        element: v.number(),
        name: v.string(),
        kind: v.string(),
        floor: v.string(),
        unseen_area_m2: area,
        achievable_area_m2: area,
      }),
    ),
    [],
  ),
  warnings: v.optional(v.array(v.string()), []),
});

export type PlanJson = v.InferOutput<typeof PlanJson>;
export type PlanStation = PlanJson['stations'][number];
export type PlanFloor = PlanJson['floors'][number];
export type PlanLink = PlanJson['registration']['links'][number];

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
