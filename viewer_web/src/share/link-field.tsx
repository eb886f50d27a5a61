/** A link to copy by hand, where the browser does not copy it. */
import { t } from '../language/language.ts';

export function LinkField({ link }: { link: string }) {
  return (
    <input
      type="text"
      class="share-link"
      aria-label={t('Link to this view')}
      readOnly
      value={link}
      onFocus={(event) => event.currentTarget.select()}
    />
  );
}
