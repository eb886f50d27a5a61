/** The tab "Review": comments, verdicts on stations, the sign-off, and who changed what. */
import '../edit/edit.css';
import { AuthorField } from './author-field.tsx';
import { CommentList } from './comment-list.tsx';
import { FieldResultSection } from './field-result-section.tsx';
import { LastChanges } from './last-changes.tsx';
import './review.css';
import { whyNoComments } from '../edit/readiness.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { SignOffSection } from './sign-off.tsx';
import { VerdictList } from './verdict-list.tsx';

interface ReviewTabProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function ReviewTab({ store, view }: ReviewTabProps) {
  const { reviewClient } = store;
  const review = reviewClient?.review.value ?? null;
  const refusal = whyNoComments(store);
  const isOther = store.planBase.value !== OWN_PLAN;
  return (
    <>
      {refusal !== null && <p class="callout">{refusal}</p>}
      {reviewClient !== null && review !== null && !isOther && (
        <>
          {refusal === null && <AuthorField reviewClient={reviewClient} />}
          <CommentList store={store} reviewClient={reviewClient} review={review} view={view} />
          <VerdictList store={store} reviewClient={reviewClient} review={review} />
          {refusal === null && <FieldResultSection store={store} reviewClient={reviewClient} />}
          <SignOffSection store={store} reviewClient={reviewClient} review={review} />
          <LastChanges review={review} />
        </>
      )}
    </>
  );
}
