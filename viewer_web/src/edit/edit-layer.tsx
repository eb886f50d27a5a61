/** What editing and comparing draw into the building, and the editor behind it. */
import { useEffect } from 'preact/hooks';
import { CompareLayer } from '../compare/compare-layer.tsx';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import './desk.css';
import { Editor } from './editor.ts';
import { listenToEditKeys } from './keys.ts';

interface EditLayerProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly view: PlanView;
}

export function EditLayer({ store, loaded, view }: EditLayerProps) {
  const { desk, editing } = store;
  useEffect(() => {
    if (desk === null) return undefined;
    const editor = new Editor(store, desk, view, loaded);
    editing.editor.value = editor;
    const stopKeys = listenToEditKeys(window, store, editor);
    return () => {
      stopKeys();
      editing.editor.value = null;
      editor.dispose();
    };
  }, [store, desk, view, loaded, editing]);
  if (desk === null) return null;
  return <CompareLayer store={store} loaded={loaded} view={view} />;
}
