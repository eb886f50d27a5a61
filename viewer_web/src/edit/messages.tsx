/** What the server says: notices, a broken line, and the choice that a conflict needs. They have a place of their own and cover nothing. */

import { NO_TOKEN } from '../api/api-error.ts';
import type { PendingConflict, Question, ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';

const ASKING = t('The server does not answer; retrying. The page may be out of date.');
const STARTED_AGAIN = t('If it was started again, open the address that it printed.');

export function Messages({ reviewClient }: { reviewClient: ReviewClient }) {
  const [notice, conflict, trouble] = [reviewClient.notice.value, reviewClient.conflict.value, troubleOf(reviewClient)];
  const question = reviewClient.question.value;
  if (notice === null && conflict === null && trouble === null && question === null) return null;
  return (
    <section class="messages" aria-label={t('Messages')}>
      {trouble !== null && (
        <div class="message-card message-warning" role="status" data-testid="trouble">
          <p>{trouble}</p>
        </div>
      )}
      {notice !== null && (
        <div class={`message-card message-${notice.kind}`} role="alert">
          <p>{notice.text}</p>
          <button
            type="button"
            class="icon"
            aria-label={t('Dismiss')}
            onClick={() => {
              reviewClient.notice.value = null;
            }}
          >
            ×
          </button>
        </div>
      )}
      {question !== null && <QuestionCard question={question} reviewClient={reviewClient} />}
      {conflict !== null && <ConflictCard conflict={conflict} reviewClient={reviewClient} />}
    </section>
  );
}

function QuestionCard({ question, reviewClient }: { question: Question; reviewClient: ReviewClient }) {
  const answer = (isYes: boolean): void => {
    reviewClient.question.value = null;
    if (isYes) question.onYes();
  };
  return (
    <div class="message-card message-conflict" role="alertdialog" aria-labelledby="question-title">
      <h2 id="question-title">{question.title}</h2>
      <p>{question.text}</p>
      <div class="buttons">
        <button type="button" class="button button-primary" onClick={() => answer(false)}>
          {t('Cancel')}
        </button>
        <button type="button" class="button" onClick={() => answer(true)}>
          {question.yes}
        </button>
      </div>
    </div>
  );
}

/** Theirs, mine, or both where they touch different things. */
function ConflictCard({ conflict, reviewClient }: { conflict: PendingConflict; reviewClient: ReviewClient }) {
  const canBoth = conflict.together() !== null;
  const isFirst = (primary: boolean): string => (primary ? 'button button-primary' : 'button');
  return (
    <div class="message-card message-conflict" role="alertdialog" aria-labelledby="conflict-title">
      <h2 id="conflict-title">{t('Someone else changed this')}</h2>
      <p>
        {conflict.words}
        {canBoth && ` ${t('The position and the height were changed by different people: both can be kept.')}`}
      </p>
      <div class="buttons">
        <button type="button" class={isFirst(!canBoth)} onClick={() => reviewClient.takeTheirs()}>
          {t('Keep theirs')}
        </button>
        <button type="button" class={isFirst(canBoth)} onClick={() => void reviewClient.applyMine()}>
          {canBoth ? t('Keep both') : t('Keep mine')}
        </button>
      </div>
    </div>
  );
}

/** What is wrong with the server for as long as it is; null: nothing. */
function troubleOf({ line, fault }: ReviewClient): string | null {
  if (line.value === 'refused') return NO_TOKEN;
  if (fault.value !== null) return fault.value;
  return line.value === 'broken' ? `${ASKING} ${STARTED_AGAIN}` : null;
}
