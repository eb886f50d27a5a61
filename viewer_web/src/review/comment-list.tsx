/** Comments: a new one, and those that are there. Their text is shown as text, whatever is in it. */

import { useState } from 'preact/hooks';
import { timeInWords } from '../api/conflict-words.ts';
import type { Comment, Review } from '../api/documents.ts';
import { type ReviewClient, UNNAMED } from '../api/review-client.ts';
import { localOf } from '../edit/draft.ts';
import { canComment } from '../edit/readiness.ts';
import { floorAt } from '../edit/review-areas.ts';
import { type Assignment, UNASSIGNED } from '../edit/state.ts';
import { t } from '../language/language.ts';
import { Section } from '../panels/section.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { AssignmentFields, AssignmentWords } from './assignment.tsx';
import { ChosenPhoto, Photo, PhotoChoice } from './photo.tsx';
import {
  addComment,
  assignComment,
  editComment,
  listedComments,
  peopleOf,
  removeComment,
  resolveComment,
} from './remarks.ts';

interface CommentListProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
  readonly review: Review;
  readonly view: PlanView | null;
}

export function CommentList({ store, reviewClient, review, view }: CommentListProps) {
  const comments = listedComments(review);
  const people = peopleOf(review);
  const nOpen = comments.filter(({ resolved }) => !resolved).length;
  return (
    <Section title={t('Comments')} aside={comments.length === 0 ? '' : t('{n} open', { n: nOpen })}>
      {canComment(store) && <NewComment store={store} reviewClient={reviewClient} people={people} />}
      <ul class="comments" aria-label={t('Comments')}>
        {comments.map((comment) => (
          <CommentEntry key={comment.id} {...{ store, reviewClient, comment, view, people }} />
        ))}
      </ul>
      {comments.length === 0 && <p class="muted">{t('No comments yet.')}</p>}
    </Section>
  );
}

interface NewCommentProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
  readonly people: readonly string[];
}

function NewComment({ store, reviewClient, people }: NewCommentProps) {
  const text = store.editing.commentText.value;
  const assignment = store.editing.commentAssignment.value;
  const photo = store.editing.commentPhoto.value;
  const [isSending, setIsSending] = useState(false);
  const spot = store.editing.commentSpot.value;
  const isPinning = store.editing.tool.value === 'comment';
  const stationId = store.stationId.value;
  const setPhoto = (next: Blob | null): void => {
    store.editing.commentPhoto.value = next;
  };
  const send = async (): Promise<boolean> => {
    try {
      const sha256 = photo === null ? '' : await reviewClient.client.keepPhoto(photo);
      const change = addComment(text.trim(), spot?.target ?? null, spot?.positionM ?? null, assignment, sha256);
      return await reviewClient.commit('comment', [change]);
    } catch (error) {
      reviewClient.warn((error as Error).message);
      return false;
    }
  };
  const post = async (): Promise<void> => {
    setIsSending(true);
    const isDone = await send().finally(() => setIsSending(false));
    if (!isDone) return;
    // Where the next one was begun meanwhile, it stays.
    if (store.editing.commentText.peek() === text) store.editing.commentText.value = '';
    if (store.editing.commentAssignment.peek() === assignment) store.editing.commentAssignment.value = UNASSIGNED;
    if (store.editing.commentPhoto.peek() === photo) store.editing.commentPhoto.value = null;
    if (store.editing.commentSpot.peek() === spot) store.editing.commentSpot.value = null;
  };
  return (
    <form
      class="new-comment"
      onSubmit={(event) => {
        event.preventDefault();
        void post();
      }}
    >
      <label class="field">
        {spot === null ? t('On the whole plan') : t('On {title}', { title: spot.title })}
        <textarea
          aria-label={t('New comment')}
          maxLength={5000}
          placeholder={t('What needs attention?')}
          value={text}
          onInput={(event) => {
            store.editing.commentText.value = event.currentTarget.value;
          }}
        />
      </label>
      {(text !== '' || assignment !== UNASSIGNED) && (
        <AssignmentFields
          value={assignment}
          people={people}
          onChange={(next) => {
            store.editing.commentAssignment.value = next;
          }}
        />
      )}
      {photo !== null && <ChosenPhoto photo={photo} onRemove={() => setPhoto(null)} />}
      <div class="buttons">
        <button type="submit" class="button button-primary button-small" disabled={text.trim() === '' || isSending}>
          {t('Comment')}
        </button>
        <button
          type="button"
          class="button button-small"
          aria-pressed={isPinning}
          onClick={() => {
            store.editing.tool.value = isPinning ? 'select' : 'comment';
          }}
        >
          {isPinning ? t('Click a surface …') : t('Pin to a surface')}
        </button>
        {stationId !== null && spot?.target !== stationId && (
          <button type="button" class="button button-small" onClick={() => pinToStation(store, stationId)}>
            {t('Pin to {id}', { id: stationId })}
          </button>
        )}
        {spot !== null && (
          <button
            type="button"
            class="button button-small"
            onClick={() => {
              store.editing.commentSpot.value = null;
            }}
          >
            {t('Unpin')}
          </button>
        )}
        {photo === null && <PhotoChoice reviewClient={reviewClient} onChange={setPhoto} />}
      </div>
    </form>
  );
}

function pinToStation(store: Store, id: string): void {
  store.editing.commentSpot.value = { target: id, positionM: null, title: t('station {id}', { id }) };
}

interface CommentEntryProps {
  readonly store: Store;
  readonly reviewClient: ReviewClient;
  readonly comment: Comment;
  readonly view: PlanView | null;
  readonly people: readonly string[];
}

function CommentEntry({ store, reviewClient, comment, view, people }: CommentEntryProps) {
  const { id, author, time, resolved, text } = comment;
  const [edited, setEdited] = useState<string | null>(null);
  const [assigned, setAssigned] = useState<Assignment | null>(null);
  const isRead = edited === null && assigned === null;
  const isMine = author === (reviewClient.author.value.trim() || UNNAMED);
  const mayChange = canComment(store);
  const place = placeInWords(store, comment);
  return (
    <li class={resolved ? 'comment comment-resolved' : 'comment'} data-comment={id}>
      <header>
        <strong>{author}</strong> <time dateTime={time}>{timeInWords(time)}</time>
        {resolved && <span class="badge badge-good">{t('resolved')}</span>}
      </header>
      {edited === null ? (
        <p class="comment-text">{text}</p>
      ) : (
        <textarea
          aria-label={t('Edited comment')}
          value={edited}
          onInput={(event) => setEdited(event.currentTarget.value)}
        />
      )}
      {comment.photo !== '' && <Photo sha256={comment.photo} />}
      {assigned === null ? (
        <AssignmentWords comment={comment} />
      ) : (
        <AssignmentFields value={assigned} people={people} onChange={setAssigned} />
      )}
      <footer>
        {place !== null && (
          <button type="button" class="chip" onClick={() => goTo(store, comment, view)}>
            {place}
          </button>
        )}
        {mayChange && isRead && (
          <button type="button" class="chip" onClick={() => setAssigned(comment)}>
            {t('Assign')}
          </button>
        )}
        {mayChange && isRead && (
          <button
            type="button"
            class="chip"
            onClick={() => void reviewClient.commit(resolved ? 'reopen' : 'resolve', [resolveComment(id, !resolved)])}
          >
            {resolved ? t('Reopen') : t('Resolve')}
          </button>
        )}
        {mayChange && isMine && isRead && (
          <>
            <button type="button" class="chip" onClick={() => setEdited(text)}>
              {t('Edit')}
            </button>
            <button
              type="button"
              class="chip"
              onClick={() => void reviewClient.commit(t('remove a comment'), [removeComment(id)])}
            >
              {t('Remove')}
            </button>
          </>
        )}
        {assigned !== null && (
          <>
            <button
              type="button"
              class="chip chip-strong"
              onClick={() => {
                setAssigned(null);
                void reviewClient.commit(t('assign a comment'), [assignComment(id, assigned)]);
              }}
            >
              {t('Save')}
            </button>
            <button type="button" class="chip" onClick={() => setAssigned(null)}>
              {t('Cancel')}
            </button>
          </>
        )}
        {edited !== null && (
          <>
            <button
              type="button"
              class="chip chip-strong"
              disabled={edited.trim() === ''}
              onClick={() => {
                setEdited(null);
                void reviewClient.commit(t('edit a comment'), [editComment(id, edited.trim())]);
              }}
            >
              {t('Save')}
            </button>
            <button type="button" class="chip" onClick={() => setEdited(null)}>
              {t('Cancel')}
            </button>
          </>
        )}
      </footer>
    </li>
  );
}

/** What it is pinned to; null: the plan. */
function placeInWords(store: Store, { target, position_m }: Comment): string | null {
  if (typeof target === 'string') return t('Station {id}', { id: target });
  if (target !== null) {
    const element = store.loaded.value?.stage.elements.find(({ sceneIndex }) => sceneIndex === target);
    return element?.name || t('Element {id}', { id: target });
  }
  return position_m === null ? null : t('Show location');
}

function goTo(store: Store, { target, position_m }: Comment, view: PlanView | null): void {
  const stage = store.loaded.value?.stage;
  if (typeof target === 'string') {
    store.chooseStation(target);
    return;
  }
  if (position_m === null || stage === undefined || view === null) return;
  const at = localOf(position_m, stage.offsetM);
  const floorId = floorAt(stage.floors, at[2]);
  store.chooseFloor(floorId);
  view.approach(at, floorId);
}
