/** Who reviews: told with every change, kept on this device. */

import type { ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';

export function AuthorField({ reviewClient }: { reviewClient: ReviewClient }) {
  return (
    <div class="section">
      <label class="field">
        {t('Your name, for changes and comments')}
        <input
          type="text"
          autoComplete="name"
          maxLength={100}
          placeholder={t('Name')}
          value={reviewClient.author.value}
          onInput={(event) => reviewClient.setAuthor(event.currentTarget.value)}
        />
      </label>
    </div>
  );
}
