/** The tab "Edit" of the sidebar. */
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

interface EditTabProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function EditTab(_: EditTabProps) {
  return null;
}
