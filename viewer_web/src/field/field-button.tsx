/** The way to the field view. */
import { t } from '../language/language.ts';
import type { Store } from '../store.ts';
import './field.css';

export function FieldButton({ store }: { store: Store }) {
  return (
    <button
      type="button"
      class="field-open"
      title={t('Next station, distance and progress: for a tablet on site')}
      onClick={() => {
        store.page.value = 'field';
      }}
    >
      {t('Field view')}
    </button>
  );
}
