/** What the server says, over the canvas: notices, a broken line, and the choice that a conflict needs. */
import type { Desk } from '../api/desk.ts';

export function Messages({ desk }: { desk: Desk }) {
  const [notice, conflict] = [desk.notice.value, desk.conflict.value];
  const isBroken = desk.line.value === 'broken' && desk.session.value !== null;
  return (
    <div class="messages">
      {isBroken && (
        <div class="message-card message-warning" role="status">
          <p>The server does not answer; asking again. What you see may be out of date.</p>
        </div>
      )}
      {notice !== null && (
        <div class={`message-card message-${notice.kind}`} role="alert">
          <p>{notice.text}</p>
          <button
            type="button"
            class="icon"
            aria-label="Dismiss"
            onClick={() => {
              desk.notice.value = null;
            }}
          >
            ×
          </button>
        </div>
      )}
      {conflict !== null && (
        <div class="message-card message-conflict" role="alertdialog" aria-labelledby="conflict-title">
          <h2 id="conflict-title">Somebody was first</h2>
          <p>{conflict.words}</p>
          <div class="buttons">
            <button type="button" class="button button-primary" onClick={() => desk.takeTheirs()}>
              Take theirs
            </button>
            <button type="button" class="button" onClick={() => void desk.applyMine()}>
              Apply mine again
            </button>
          </div>
        </div>
      )}
    </div>
  );
}
