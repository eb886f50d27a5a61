/** The sign-off: who says that the plan, as reviewed, is to be carried out. */

import { useState } from 'preact/hooks';
import { timeInWords } from '../api/conflict-words.ts';
import type { Review } from '../api/documents.ts';
import type { ReviewClient } from '../api/review-client.ts';
import { canComment, canEdit, whyNoEditing } from '../edit/readiness.ts';
import { stationsOf } from '../edit/review-stations.ts';
import { totalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import { counted } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { type Concern, concernsOf } from './concerns.ts';
import { changesSinceSignature, sign, unsign } from './remarks.ts';

interface SignOffProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
  readonly review: Review;
}

export function SignOffSection({ store, reviewClient, review }: SignOffProps) {
  const signed = review.sign_off;
  const concerns = openConcerns(store, review);
  return (
    <Section title={t('Sign-off')}>
      {signed === null ? (
        <p class="muted">{t('Not signed off yet.')}</p>
      ) : (
        <Signature reviewClient={reviewClient} review={review} mayWithdraw={canEdit(store)} />
      )}
      <ConcernList concerns={concerns} />
      {canEdit(store) && signed === null && <SignForm reviewClient={reviewClient} concerns={concerns} />}
      {canComment(store) && !canEdit(store) && <p class="hint">{whyNoEditing(store)}</p>}
    </Section>
  );
}

function openConcerns(store: Store, review: Review): readonly Concern[] {
  const [plan, totals] = [store.loaded.value?.plan, totalsBeside(store)];
  if (plan === undefined || totals === null) return [];
  return concernsOf({ review, stations: stationsOf(store), totals });
}

function ConcernList({ concerns }: { concerns: readonly Concern[] }) {
  if (concerns.length === 0) return null;
  return (
    <>
      <p class="concerns-title">{t('Open points:')}</p>
      <ul class="concerns" aria-label={t('Open points')}>
        {concerns.map(({ kind, words }) => (
          <li key={words} data-concern={kind}>
            {words}
          </li>
        ))}
      </ul>
    </>
  );
}

function SignForm({ reviewClient, concerns }: { reviewClient: ReviewClient; concerns: readonly Concern[] }) {
  const [note, setNote] = useState('');
  const open = concerns.map(({ words }) => words).join('\n');
  // Of these points and no others: who has agreed to some is asked again when there are more.
  const [accepted, setAccepted] = useState('');
  const name = reviewClient.author.value.trim();
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        void reviewClient.commit(t('sign off'), [sign(note.trim())]);
      }}
    >
      <label class="field">
        {t('Note')}
        <input
          type="text"
          maxLength={500}
          placeholder={t('Optional')}
          value={note}
          onInput={(event) => setNote(event.currentTarget.value)}
        />
      </label>
      {open !== '' && (
        <label class="check">
          <input
            type="checkbox"
            checked={accepted === open}
            onChange={(event) => setAccepted(event.currentTarget.checked ? open : '')}
          />
          {concerns.length === 1 ? t('Sign off with this point open') : t('Sign off with these points open')}
        </label>
      )}
      <div class="buttons">
        <button type="submit" class="button button-primary" disabled={name === '' || accepted !== open}>
          {name === '' ? t('Sign off') : t('Sign off as {name}', { name })}
        </button>
      </div>
      {name === '' && <p class="hint">{t('Enter your name above to sign off.')}</p>}
    </form>
  );
}

function Signature({
  reviewClient,
  review,
  mayWithdraw,
}: {
  reviewClient: ReviewClient;
  review: Review;
  mayWithdraw: boolean;
}) {
  const signed = review.sign_off;
  if (signed === null) return null;
  const nSince = changesSinceSignature(review);
  const isOtherPlan = signed.plan_sha256 !== reviewClient.session.value?.plan_sha256;
  return (
    <div data-testid="signature">
      <p>
        <strong>{signed.name}</strong> {t('signed off')} <time dateTime={signed.time}>{timeInWords(signed.time)}</time>
      </p>
      {signed.note !== '' && <p class="comment-text">{signed.note}</p>}
      {isOtherPlan && <p class="note note-warn">{t('Signed off for an earlier plan; this one was made since.')}</p>}
      {!isOtherPlan && nSince > 0 && (
        <p class="note note-warn">
          {t('{changes} since: sign off again if it still holds.', { changes: counted(nSince, 'change') })}
        </p>
      )}
      {!isOtherPlan && nSince === 0 && <p class="note">{t('No changes since.')}</p>}
      {mayWithdraw && (
        <div class="buttons">
          <button
            type="button"
            class="button button-small"
            onClick={() => void reviewClient.commit(t('withdraw the sign-off'), [unsign()])}
          >
            {t('Withdraw sign-off')}
          </button>
        </div>
      )}
    </div>
  );
}
