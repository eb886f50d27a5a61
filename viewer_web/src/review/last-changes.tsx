/** Who changed what, newest first. */

import { timeInWords } from '../api/conflict-words.ts';
import type { Review } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { Section } from '../panels/section.tsx';
import { changeInWords } from './change-words.ts';
import { lastChanges } from './remarks.ts';

const MOST = 12;

export function LastChanges({ review }: { review: Review }) {
  const changes = lastChanges(review, MOST);
  return (
    <Section title={t('Last changes')} aside={t('revision {n}', { n: review.revision })}>
      {changes.length === 0 && <p class="muted">{t('No changes yet.')}</p>}
      <ul class="last-changes" aria-label={t('Last changes')}>
        {changes.map(({ object, by, at }) => (
          <li key={object}>
            <span>{t('{change} by {by}', { change: changeInWords(object, review), by })}</span>
            <span class="muted">{timeInWords(at)}</span>
          </li>
        ))}
      </ul>
    </Section>
  );
}
