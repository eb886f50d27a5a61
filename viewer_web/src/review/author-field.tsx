/** Who reviews: told with every change, kept on this device. */
import type { Desk } from '../api/desk.ts';

export function AuthorField({ desk }: { desk: Desk }) {
  return (
    <div class="section">
      <label class="field">
        Your name, for changes and comments
        <input
          type="text"
          autoComplete="name"
          maxLength={100}
          placeholder="Name"
          value={desk.author.value}
          onInput={(event) => desk.setAuthor(event.currentTarget.value)}
        />
      </label>
    </div>
  );
}
