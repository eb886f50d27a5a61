/** Which floors a plan is of. */

/** Whether a floor is among those asked for, by id or name; none told: all are. */
export function isPlanned({ id, name }: { id: string; name: string }, asked: readonly string[] = []): boolean {
  const names = asked.map((each) => each.toLowerCase());
  return names.length === 0 || names.includes(id.toLowerCase()) || names.includes(name.toLowerCase());
}
