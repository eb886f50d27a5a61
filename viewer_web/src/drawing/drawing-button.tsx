/** The way to the drawing, where the plan was made from one. */

import { useEffect } from 'preact/hooks';
import { t } from '../language/language.ts';
import type { Store } from '../store.ts';
import './drawing.css';

export function DrawingButton({ store }: { store: Store }) {
  const { drawing, reviewClient } = store;
  const isOpen = reviewClient !== null && reviewClient.session.value !== null;
  useEffect(() => {
    if (isOpen && drawing !== null && drawing.drawn.peek() === null) void drawing.open();
  }, [isOpen, drawing]);
  if (drawing === null || drawing.drawn.value === null) return null;
  const nDoubtful = drawing.drawn.value.storeys.reduce(
    (n, { openings }) => n + openings.filter(({ doubtful }) => doubtful).length,
    0,
  );
  return (
    <button
      type="button"
      class="button drawing-open"
      onClick={() => {
        store.page.value = 'drawing';
      }}
    >
      {t('Correct the drawing')}
      {nDoubtful > 0 && (
        <span class="drawing-count">
          {t('{n, plural, one {# gap to check} other {# gaps to check}}', { n: nDoubtful })}
        </span>
      )}
    </button>
  );
}
