/** plan.json as it is loaded: the types and the check are made of the model that writes it. */

import type { Frozen } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { PlanLoadError } from './plan-load-error.ts';
import schema from './plan-schema.json';
import type * as plan from './plan-types.ts';
import { checkedBy, type JsonSchema, Misfit } from './schema-check.ts';

export type PlanJson = plan.PlanDocument;
export type PlanStation = plan.StationSection;
export type PlanFloor = plan.FloorSection;
/** How far one part of what was required is met: a floor, a class, a zone, or all of it. */
export type RequirementResult = Pick<plan.ResultSection, 'name' | 'required' | 'fraction_of_achievable' | 'met'> &
  Partial<Pick<plan.ResultSection, 'as_set_up'>>;
/** What a requirement, by its name in the results, would lose without a station. */
export type StationLoss = plan.LossSection;
export type PlanLink = plan.Link;
export type WeakMotion = plan.WeakMotion;
export type NetworkJoin = plan.NetworkJoin;
export type PlanNetwork = plan.NetworkSection;
export type UnseenSurface = Frozen<plan.UnseenSurfaceSection>;
export type PlanRoute = plan.RouteSection;

/** Check a parsed plan.json, and fill in what plans of older versions lack; the error names the first key that does not fit. */
export function parsePlan(json: unknown): PlanJson {
  try {
    return checkedBy(schema as JsonSchema, json) as PlanJson;
  } catch (misfit) {
    if (!(misfit instanceof Misfit)) throw misfit;
    const remedy =
      misfit.keys[0] === 'schema'
        ? t('Write the plan again with this version of tlsplan.')
        : t('Write the plan again with `tlsplan plan`.');
    throw new PlanLoadError(`plan.json: ${misfit.message}. ${remedy}`);
  }
}
