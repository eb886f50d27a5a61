/** How the building is painted and looked at. */
import type { PlanView } from '../scene/plan-view.ts';
import type { Paint, Store } from '../store.ts';

export function Toolbar({ store, view }: { store: Store; view: PlanView }) {
  const paints: [Paint, string][] = [
    ['coverage', 'Coverage'],
    ['plain', 'Plain'],
  ];
  return (
    <div class="toolbar" role="toolbar" aria-label="View">
      <button
        type="button"
        class="icon"
        aria-label={store.isSidebarOpen.value ? 'Hide the panel' : 'Show the panel'}
        aria-expanded={store.isSidebarOpen.value}
        onClick={() => {
          store.isSidebarOpen.value = !store.isSidebarOpen.value;
        }}
      >
        ☰
      </button>
      <div class="segments" role="radiogroup" aria-label="Colour of the building">
        {paints.map(([paint, label]) => (
          // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
          <button
            key={paint}
            type="button"
            role="radio"
            aria-checked={store.paint.value === paint}
            onClick={() => {
              store.paint.value = paint;
            }}
          >
            {label}
          </button>
        ))}
      </div>
      <button
        type="button"
        class="tool"
        aria-pressed={store.showLinks.value}
        title="Lines between stations that overlap enough to be registered"
        onClick={() => {
          store.showLinks.value = !store.showLinks.value;
        }}
      >
        Links
      </button>
      <span class="gap" />
      <button type="button" class="tool" title="All of it, from the side (H)" onClick={() => view.showAll('side')}>
        Overview
      </button>
      <button type="button" class="tool" title="From above (T)" onClick={() => view.showAll('top')}>
        From above
      </button>
    </div>
  );
}
