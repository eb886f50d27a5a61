/**
 * Numbers of stations on marks, in lists and in tables, by id: 4 for "S004", wherever the route has it; the places in this list
 * where ids are no such numbers. Exports have the same: `station_numbers` of `planner_core/plan_folder/plan_source.py`.
 */
export function stationNumbers(ids: readonly string[]): ReadonlyMap<string, number> {
  const found = ids.flatMap((id) => /^S0*(\d{1,4})$/.exec(id)?.[1] ?? []).map(Number);
  const areTheirs = new Set(found).size === ids.length;
  return new Map(ids.map((id, i) => [id, areTheirs ? found[i] : i + 1]));
}
