/** Whom a comment is for, and the day by which: as fields, and in words. */
import { useId } from 'preact/hooks';
import type { Comment } from '../api/documents.ts';
import type { Assignment } from '../edit/state.ts';
import { dateLocale, t } from '../language/language.ts';
import { isOverdue } from './remarks.ts';

interface AssignmentFieldsProps {
  readonly value: Assignment;
  /** To choose from; others can be typed. */
  readonly people: readonly string[];
  readonly onChange: (next: Assignment) => void;
}

export function AssignmentFields({ value: { assignee, due }, people, onChange }: AssignmentFieldsProps) {
  const list = useId();
  return (
    <div class="fields">
      <label class="field">
        {t('For')}
        <input
          type="text"
          list={list}
          maxLength={100}
          placeholder={t('Name')}
          value={assignee}
          onInput={(event) => onChange({ assignee: event.currentTarget.value, due })}
        />
        <datalist id={list}>
          {people.map((name) => (
            <option key={name} value={name} />
          ))}
        </datalist>
      </label>
      <label class="field">
        {t('Due')}
        <input type="date" value={due} onInput={(event) => onChange({ assignee, due: event.currentTarget.value })} />
      </label>
    </div>
  );
}

export function AssignmentWords({ comment }: { comment: Comment }) {
  const { assignee, due } = comment;
  if (assignee === '' && due === '') return null;
  const day = due === '' ? '' : new Date(`${due}T12:00:00`).toLocaleDateString(dateLocale, { dateStyle: 'medium' });
  return (
    <p class="comment-assignment">
      {assignee !== '' && <span class="badge badge-part">{t('for {name}', { name: assignee })}</span>}
      {day !== '' &&
        (isOverdue(comment, new Date()) ? (
          <span class="badge badge-warn">{t('overdue since {day}', { day })}</span>
        ) : (
          <span class="muted">{t('by {day}', { day })}</span>
        ))}
    </p>
  );
}
