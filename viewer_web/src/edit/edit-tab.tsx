/** The tab "Edit": tools, the chosen station, and everything the review changes, each with its way back. */
import { t } from '../language/language.ts';
import { AuthorField } from '../review/author-field.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { ChangeList } from './change-list.tsx';
import { DoorsNote } from './entrance-parts.tsx';
import './edit.css';
import { whyNoEditing, whyNotLive } from './readiness.ts';
import { StationEditing } from './station-editing.tsx';
import { ToolPicker } from './tool-picker.tsx';

interface EditTabProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function EditTab({ store }: EditTabProps) {
  const refusal = whyNoEditing(store);
  if (refusal !== null) return <p class="callout">{refusal}</p>;
  return (
    <>
      <LiveNote store={store} />
      <ToolPicker store={store} />
      <DoorsNote store={store} />
      <StationEditing store={store} />
      <ChangeList store={store} />
      {store.reviewClient !== null && <AuthorField reviewClient={store.reviewClient} />}
    </>
  );
}

function LiveNote({ store }: { store: Store }) {
  const words = whyNotLive(store);
  const live = store.reviewClient?.live.value;
  if (words === null || live === undefined) return null;
  const fraction = live.fraction ?? null;
  return (
    <div class="callout" role="status" data-testid="live-note">
      {words}
      {live.state === 'starting' && (
        <progress aria-label={t('Preparing live editing')} {...(fraction === null ? {} : { value: fraction })} />
      )}
    </div>
  );
}
