/** How the building is painted and looked at. */

import { PLAIN } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import { ShareMenu } from '../share/share-menu.tsx';
import type { Store } from '../store.ts';
import { chooseUnits, units } from './units.ts';

/** No floor's id is empty. */
const ALL_FLOORS = '';

export function Toolbar({ store, view }: { store: Store; view: PlanView }) {
  const off = whyNoPicture(store);
  return (
    <div class="toolbar" role="toolbar" aria-label={t('View')}>
      <button
        type="button"
        class="icon"
        aria-label={store.isSidebarOpen.value ? t('Hide the panel') : t('Show the panel')}
        aria-expanded={store.isSidebarOpen.value}
        onClick={() => {
          store.isSidebarOpen.value = !store.isSidebarOpen.value;
        }}
      >
        ☰
      </button>
      <FloorSelect store={store} />
      <LayerSelect store={store} />
      <Toggle
        name={t('Links')}
        hint={t('Lines between stations that overlap enough to register')}
        isOn={store.showLinks.value}
        onClick={() => {
          store.showLinks.value = !store.showLinks.value;
        }}
      />
      <Toggle
        name={t('Clouds')}
        hint={t('Point clouds of all stations on the shown floors')}
        off={off}
        isOn={store.showClouds.value}
        onClick={() => {
          store.showClouds.value = !store.showClouds.value;
        }}
      />
      <Toggle
        name={t('Feet')}
        hint={t('Lengths, areas and coordinates in feet and inches')}
        isOn={units.value === 'ft'}
        onClick={() => chooseUnits(window.localStorage, units.value === 'ft' ? 'm' : 'ft')}
      />
      <div class="toolbar-end">
        <Toggle
          name={t('Walk')}
          hint={t('Walk through the building at eye height (W)')}
          off={off}
          isOn={store.isWalking.value}
          onClick={() => (store.isWalking.value ? view.walk.leave() : view.startWalk())}
        />
        <button
          type="button"
          class="tool"
          disabled={off !== null}
          title={off ?? t('Whole building, from the side (H)')}
          onClick={() => view.showAll('side')}
        >
          3D
        </button>
        <button type="button" class="tool" title={t('Top view (T)')} onClick={() => view.showAll('top')}>
          {t('Top')}
        </button>
        <ShareMenu store={store} view={view} />
      </div>
    </div>
  );
}

function FloorSelect({ store }: { store: Store }) {
  return (
    <label class="tool tool-select">
      <span class="muted">{t('Floor')}</span>
      <select
        aria-label={t('Shown floor')}
        value={store.floorId.value ?? ALL_FLOORS}
        onChange={({ currentTarget: { value } }) => store.chooseFloor(value === ALL_FLOORS ? null : value)}
      >
        <option value={ALL_FLOORS}>{t('All floors')}</option>
        {[...(store.loaded.value?.stage.floors ?? [])].reverse().map(({ id, name }) => (
          <option key={id} value={id}>
            {name}
          </option>
        ))}
      </select>
    </label>
  );
}

function LayerSelect({ store }: { store: Store }) {
  const off = whyNoPicture(store);
  return (
    <label class="tool tool-select" title={off ?? undefined}>
      <span class="muted">{t('Colour')}</span>
      <select
        aria-label={t('Colour of the building')}
        disabled={off !== null}
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
        <option value={PLAIN}>{t('Plain')}</option>
        {store.loaded.value?.layers === null && (
          <option disabled>{t('Ranges and reasons: made by an older version, plan again')}</option>
        )}
      </select>
    </label>
  );
}

interface ToggleProps {
  readonly name: string;
  readonly hint: string;
  /** Why it is switched off; null: it is not. */
  readonly off?: string | null;
  readonly isOn: boolean;
  readonly onClick: () => void;
}

function Toggle({ name, hint, off = null, isOn, onClick }: ToggleProps) {
  return (
    <button
      type="button"
      class="tool"
      aria-pressed={isOn}
      disabled={off !== null}
      title={off ?? hint}
      onClick={onClick}
    >
      {name}
    </button>
  );
}
