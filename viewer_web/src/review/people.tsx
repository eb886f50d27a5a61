/** Who else has the plan open. */
import type { ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';
import './people.css';

/** Of more their number is told. */
const MOST_SHOWN = 7;

export function People({ reviewClient }: { reviewClient: ReviewClient }) {
  const others = reviewClient.others.value;
  if (others.length === 0) return null;
  const shown = others.length > MOST_SHOWN ? others.slice(0, MOST_SHOWN - 1) : others;
  const left = others.slice(shown.length);
  return (
    <div class="people" role="img" aria-label={t('Also here: {names}', { names: others.join(', ') })}>
      <p class="muted">{t('Also here')}</p>
      {shown.map((name) => (
        <span key={name} title={name}>
          {initials(name)}
        </span>
      ))}
      {left.length > 0 && <span title={left.join(', ')}>+{left.length}</span>}
    </div>
  );
}

/** Of the first and the last word. */
export function initials(name: string): string {
  const words = name.split(/\s+/).filter(Boolean);
  const ends = words.length > 1 ? [words[0], words[words.length - 1]] : words;
  return ends.map((word) => [...word][0].toLocaleUpperCase()).join('');
}
