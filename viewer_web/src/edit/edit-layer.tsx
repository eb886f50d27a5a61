/** What editing and comparing draw into the building, and the editor behind it. */
import { useEffect } from 'preact/hooks';
import { CompareLayer } from '../compare/compare-layer.tsx';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import './edit.css';
import { Editor } from './editor.ts';
import { listenToEditKeys } from './keys.ts';

interface EditLayerProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly view: PlanView;
}

export function EditLayer({ store, loaded, view }: EditLayerProps) {
  const { reviewClient, editing } = store;
  useEffect(() => {
    if (reviewClient === null) return undefined;
    const editor = new Editor(store, reviewClient, view, loaded);
    editing.editor.value = editor;
    const stopKeys = listenToEditKeys(window, store, editor, () => view.heading());
    return () => {
      stopKeys();
      editing.editor.value = null;
      editor.dispose();
    };
  }, [store, reviewClient, view, loaded, editing]);
  if (reviewClient === null) return null;
  return <CompareLayer store={store} loaded={loaded} view={view} />;
}
