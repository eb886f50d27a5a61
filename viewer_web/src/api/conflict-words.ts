/** What a conflict is about, for the person who has to choose. */
import { dateLocale, t } from '../language/language.ts';
import type { ConflictAnswer } from './documents.ts';

const KINDS: Readonly<Record<string, string>> = {
  station: t('station'),
  verdict: t('the verdict on station'),
  progress: t('the progress of station'),
  comment: t('comment'),
  zone: t('zone'),
  forbidden: t('forbidden position'),
  pick: t('floor mark'),
  entrance: t('entrance'),
  door: t('door'),
  sign_off: t('the sign-off'),
};

/** "station:S003" as "station S003". */
export function objectInWords(object: string): string {
  const [kind, id = ''] = object.split(':');
  return `${KINDS[kind] ?? kind.replaceAll('_', ' ')} ${id}`.trim();
}

export function conflictInWords({ conflicts, message }: ConflictAnswer): string {
  if (conflicts.length === 0) return message;
  const parts = conflicts.map(({ object, by, at }) =>
    t('{by} changed {object} {time}', { by, object: objectInWords(object), time: timeInWords(at) }),
  );
  return t('{changes}. Your change was not applied.', { changes: parts.join('; ') });
}

/** "on 3 Nov 2026 at 14:05", of today too: what is printed or signed is read on other days. The text itself where it is no time. */
export function timeInWords(at: string): string {
  const time = new Date(at);
  if (Number.isNaN(time.getTime())) return at;
  return t('on {date} at {clock}', {
    date: time.toLocaleDateString(dateLocale, { day: 'numeric', month: 'short', year: 'numeric' }),
    clock: time.toLocaleTimeString(dateLocale, { hour: '2-digit', minute: '2-digit' }),
  });
}
