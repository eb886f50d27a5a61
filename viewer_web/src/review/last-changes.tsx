/** Who changed what, newest first. */
import { timeInWords } from '../api/conflict-words.ts';
import type { Review } from '../api/documents.ts';
import { Section } from '../panels/section.tsx';
import { changeInWords } from './change-words.ts';
import { lastChanges } from './remarks.ts';

const MOST = 12;

export function LastChanges({ review }: { review: Review }) {
  const changes = lastChanges(review, MOST);
  return (
    <Section title="Last changes" aside={`revision ${review.revision}`}>
      {changes.length === 0 && <p class="muted">No changes yet.</p>}
      <ul class="last-changes" aria-label="Last changes">
        {changes.map(({ object, by, at }) => (
          <li key={object}>
            <span>
              {changeInWords(object, review)} by {by}
            </span>
            <span class="muted">{timeInWords(at)}</span>
          </li>
        ))}
      </ul>
    </Section>
  );
}
