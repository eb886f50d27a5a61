/** The tab "Review" of the sidebar. */
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

interface ReviewTabProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function ReviewTab(_: ReviewTabProps) {
  return null;
}
