/** Who reviews: told with every change, kept on this device. */
import type { ReviewClient } from '../api/review-client.ts';

export function AuthorField({ reviewClient }: { reviewClient: ReviewClient }) {
  return (
    <div class="section">
      <label class="field">
        Your name, for changes and comments
        <input
          type="text"
          autoComplete="name"
          maxLength={100}
          placeholder="Name"
          value={reviewClient.author.value}
          onInput={(event) => reviewClient.setAuthor(event.currentTarget.value)}
        />
      </label>
    </div>
  );
}
