/** How the building is painted and looked at. */
import { PLAIN } from '../heat/layers.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';

/** No floor's id is empty. */
const ALL_FLOORS = '';

export function Toolbar({ store, view }: { store: Store; view: PlanView }) {
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
      <label class="tool tool-select">
        <span class="muted">Floor</span>
        <select
          aria-label="Floor that is shown"
          value={store.floorId.value ?? ALL_FLOORS}
          onChange={({ currentTarget: { value } }) => store.chooseFloor(value === ALL_FLOORS ? null : value)}
        >
          <option value={ALL_FLOORS}>All floors</option>
          {[...(store.loaded.value?.stage.floors ?? [])].reverse().map(({ id, name }) => (
            <option key={id} value={id}>
              {name}
            </option>
          ))}
        </select>
      </label>
      <label class="tool tool-select">
        <span class="muted">Colour</span>
        <select
          aria-label="Colour of the building"
          value={store.layerId.value}
          onChange={(event) => {
            store.layerId.value = event.currentTarget.value;
          }}
        >
          {store.layers.value.map(({ id, title }) => (
            <option key={id} value={id}>
              {title}
            </option>
          ))}
          <option value={PLAIN}>Plain</option>
          {store.loaded.value?.layers === null && (
            <option disabled>Ranges and reasons: plan again, an older version made this</option>
          )}
        </select>
      </label>
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
      <button
        type="button"
        class="tool"
        aria-pressed={store.showClouds.value}
        title="What all stations of the shown floors scan"
        onClick={() => {
          store.showClouds.value = !store.showClouds.value;
        }}
      >
        Clouds
      </button>
      <span class="gap" />
      <button
        type="button"
        class="tool"
        aria-pressed={store.isWalking.value}
        title="Through the building at eye height (W)"
        onClick={() => (store.isWalking.value ? view.walk.leave() : view.startWalk())}
      >
        Walk
      </button>
      <button type="button" class="tool" title="All of it, from the side (H)" onClick={() => view.showAll('side')}>
        Overview
      </button>
      <button type="button" class="tool" title="From above (T)" onClick={() => view.showAll('top')}>
        From above
      </button>
    </div>
  );
}
