/** What a conflict is about, for the person who has to choose. */
import type { ConflictAnswer } from './documents.ts';

const KINDS: Readonly<Record<string, string>> = {
  station: 'station',
  verdict: 'the verdict on station',
  comment: 'comment',
  zone: 'zone',
  forbidden: 'forbidden position',
  pick: 'floor mark',
  entrance: 'entrance',
  door: 'door',
  sign_off: 'the sign-off',
};

/** "station:S003" as "station S003". */
export function objectInWords(object: string): string {
  const [kind, id = ''] = object.split(':');
  return `${KINDS[kind] ?? kind.replaceAll('_', ' ')} ${id}`.trim();
}

export function conflictInWords({ conflicts, message }: ConflictAnswer): string {
  if (conflicts.length === 0) return message;
  const parts = conflicts.map(({ object, by, at }) => `${by} changed ${objectInWords(object)} ${timeInWords(at)}`);
  return `${parts.join('; ')}. Your change was not applied.`;
}

/** "at 14:05" of today, "on 3 Nov at 14:05" otherwise; the text itself where it is no time. */
export function timeInWords(at: string, now = new Date()): string {
  const time = new Date(at);
  if (Number.isNaN(time.getTime())) return at;
  const clock = time.toLocaleTimeString('en-GB', { hour: '2-digit', minute: '2-digit' });
  if (time.toDateString() === now.toDateString()) return `at ${clock}`;
  return `on ${time.toLocaleDateString('en-GB', { day: 'numeric', month: 'short' })} at ${clock}`;
}
