/** The changes that remarks are made of, and how they are listed. */
import type { Change, Comment, LastChange, Point, Review } from '../api/documents.ts';
import type { Assignment } from '../edit/state.ts';

export function addComment(
  text: string,
  target: string | number | null,
  positionM: Point | null,
  { assignee, due }: Assignment,
  photo = '',
): Change {
  return { kind: 'add_comment', text, target, position_m: positionM, assignee: assignee.trim(), due, photo };
}
export const assignComment = (id: string, { assignee, due }: Assignment): Change => ({
  kind: 'assign_comment',
  id,
  assignee: assignee.trim(),
  due,
});
export const editComment = (id: string, text: string): Change => ({ kind: 'edit_comment', id, text });
export const resolveComment = (id: string, resolved: boolean): Change => ({ kind: 'resolve_comment', id, resolved });
export const removeComment = (id: string): Change => ({ kind: 'remove_comment', id });
export const setVerdict = (station: string, verdict: 'accepted' | 'rejected', note = ''): Change => ({
  kind: 'set_verdict',
  station,
  verdict,
  note,
});
export const clearVerdict = (station: string): Change => ({ kind: 'clear_verdict', station });
export const sign = (note: string): Change => ({ kind: 'sign', note });
export const unsign = (): Change => ({ kind: 'unsign' });

/** Whether the day by which a comment was to be dealt with is over. */
export function isOverdue({ due, resolved }: Pick<Comment, 'due' | 'resolved'>, now: Date): boolean {
  return !resolved && due !== '' && new Date(`${due}T23:59:59`) < now;
}

/** Everybody whom a review names, for a list to choose from. */
export function peopleOf({ comments, verdicts, touched }: Review): string[] {
  const names = [
    ...Object.values(comments).flatMap(({ author, assignee }) => [author, assignee]),
    ...Object.values(verdicts).map(({ by }) => by),
    ...Object.values(touched).map(({ by }) => by),
  ];
  return [...new Set(names.filter(Boolean))].sort((a, b) => a.localeCompare(b));
}

/** Open ones first, newest first. */
export function listedComments(review: Review): Comment[] {
  return Object.values(review.comments).sort(
    (a, b) => Number(a.resolved) - Number(b.resolved) || b.time.localeCompare(a.time) || b.id.localeCompare(a.id),
  );
}

/** Who changed what last, newest first. */
export function lastChanges(review: Review, most: number): (LastChange & { readonly object: string })[] {
  return Object.entries(review.touched)
    .map(([object, change]) => ({ object, ...change }))
    .sort((a, b) => b.revision - a.revision || a.object.localeCompare(b.object))
    .slice(0, most);
}

/** How many objects were changed after the plan was signed; the signature's own revision is the one before. */
export function changesSinceSignature(review: Review): number {
  const { sign_off, touched } = review;
  if (sign_off === null) return 0;
  // A crew that carries the plan out changes nothing of it.
  return Object.entries(touched).filter(
    ([object, { revision }]) =>
      object !== 'sign_off' && !object.startsWith('progress:') && revision > sign_off.revision,
  ).length;
}

/** How many stations are accepted, rejected, and not judged yet. */
export function countVerdicts(
  review: Review,
  stationIds: readonly string[],
): { readonly accepted: number; readonly rejected: number; readonly open: number } {
  const counts = { accepted: 0, rejected: 0, open: 0 };
  for (const id of stationIds) counts[review.verdicts[id]?.verdict ?? 'open']++;
  return counts;
}
