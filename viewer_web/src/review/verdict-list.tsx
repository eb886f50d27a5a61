/** What reviewers think of each station: accepted, rejected, or not judged yet. */

import { timeInWords } from '../api/conflict-words.ts';
import type { Review } from '../api/documents.ts';
import type { ReviewClient } from '../api/review-client.ts';
import { canComment } from '../edit/readiness.ts';
import { stationsOf } from '../edit/review-stations.ts';
import { t } from '../language/language.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { clearVerdict, countVerdicts, setVerdict } from './remarks.ts';

interface VerdictListProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
  readonly review: Review;
}

export function VerdictList({ store, reviewClient, review }: VerdictListProps) {
  const stations = stationsOf(store).filter(({ isRemoved }) => !isRemoved);
  const counts = countVerdicts(
    review,
    stations.map(({ id }) => id),
  );
  const open = stations.filter(({ id }) => review.verdicts[id] === undefined);
  const mayChange = canComment(store);
  return (
    <Section title={t('Stations')} aside={t('{accepted} accepted, {rejected} rejected, {open} open', counts)}>
      <ul class="verdicts" aria-label={t('Verdicts')}>
        {stations.map(({ id, number }) => (
          <li key={id} class="verdict">
            <button
              type="button"
              class={store.stationId.value === id ? 'verdict-station verdict-chosen' : 'verdict-station'}
              onClick={() => store.chooseStation(id)}
            >
              <span class="dot" aria-hidden="true">
                {number}
              </span>
              <span>
                {id}
                <small>{wordsOf(review, id)}</small>
              </span>
            </button>
            <span class="verdict-buttons">
              {(['accepted', 'rejected'] as const).map((verdict) => (
                <VerdictButton
                  key={verdict}
                  id={id}
                  verdict={verdict}
                  isSet={review.verdicts[id]?.verdict === verdict}
                  reviewClient={reviewClient}
                  isDisabled={!mayChange}
                />
              ))}
            </span>
          </li>
        ))}
      </ul>
      {mayChange && open.length > 1 && (
        <div class="buttons">
          <button
            type="button"
            class="button button-small"
            onClick={() =>
              void reviewClient.commit(
                t('accept the rest'),
                open.map(({ id }) => setVerdict(id, 'accepted')),
              )
            }
          >
            {t('Accept the other {n}', { n: open.length })}
          </button>
        </div>
      )}
    </Section>
  );
}

function wordsOf(review: Review, id: string): string {
  const verdict = review.verdicts[id];
  return verdict === undefined
    ? ''
    : verdict.verdict === 'accepted'
      ? t('accepted by {by} {time}', { by: verdict.by, time: timeInWords(verdict.time) })
      : t('rejected by {by} {time}', { by: verdict.by, time: timeInWords(verdict.time) });
}

interface VerdictButtonProps {
  readonly id: string;
  readonly verdict: 'accepted' | 'rejected';
  readonly isSet: boolean;
  readonly reviewClient: ReviewClient;
  readonly isDisabled: boolean;
}

function VerdictButton({ id, verdict, isSet, reviewClient, isDisabled }: VerdictButtonProps) {
  const word = verdict === 'accepted' ? t('Accept') : t('Reject');
  return (
    <button
      type="button"
      class={`verdict-button verdict-${verdict}`}
      aria-label={`${word} ${id}`}
      aria-pressed={isSet}
      disabled={isDisabled}
      onClick={() =>
        void reviewClient.commit(`${word.toLowerCase()} ${id}`, [isSet ? clearVerdict(id) : setVerdict(id, verdict)])
      }
    >
      {verdict === 'accepted' ? '✓' : '✕'}
    </button>
  );
}
