/** The list of floors: which one is opened, and where it is cut. */

import type { FloorTotal } from '../edit/totals.ts';
import { totalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import type { PlanFloor } from '../load/plan-json.ts';
import { counted, lengthWords, reachedPercent } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import { Meter } from '../panels/summary.tsx';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { DEFAULT_CUT_M, highestCutM, LOWEST_CUT_M } from './cut.ts';
import { isPlanned } from './planned.ts';

export function FloorSelector({ store }: { store: Store }) {
  const loaded = store.loaded.value;
  if (loaded === null) return null;
  const { floors } = loaded.plan;
  const stations = store.shownStations.value;
  const totals = totalsBeside(store);
  const shown = totals?.edited ?? totals?.planned;
  // Highest first, as in a section of the building.
  const highestFirst = [...floors].sort((a, b) => b.elevation_m - a.elevation_m);
  return (
    <Section title={t('Floors')}>
      <div class="rows" role="radiogroup" aria-label={t('Floor')}>
        <FloorRow store={store} id={null} name={t('All floors')} detail={counted(stations.length, 'station')} />
        {highestFirst.map((floor) => (
          <FloorRow
            key={floor.id}
            store={store}
            id={floor.id}
            name={floor.name}
            detail={detailOf(
              floor,
              isPlanned(floor, loaded.plan.requirements.floors)
                ? counted(stations.filter(({ floorId }) => floorId === floor.id).length, 'station')
                : t('not in this plan'),
            )}
            covered={shown?.floors.find(({ id }) => id === floor.id)}
          />
        ))}
      </div>
      <CutControl store={store} />
    </Section>
  );
}

function detailOf(floor: PlanFloor, what: string): string {
  const sign = floor.elevation_m < 0 ? '−' : '+';
  return `${sign}${lengthWords(Math.abs(floor.elevation_m))} · ${what}`;
}

interface FloorRowProps {
  readonly store: Store;
  readonly id: string | null;
  readonly name: string;
  readonly detail: string;
  readonly covered?: FloorTotal | undefined;
}

function FloorRow({ store, id, name, detail, covered }: FloorRowProps) {
  const isChosen = store.floorId.value === id;
  return (
    // biome-ignore lint/a11y/useSemanticElements: a radio input can't hold the row's content.
    <button
      type="button"
      role="radio"
      aria-checked={isChosen}
      class={isChosen ? 'row row-chosen' : 'row'}
      data-floor={id ?? 'all'}
      onClick={() => store.chooseFloor(id)}
    >
      <span class="row-main">
        <span class="row-name">{name}</span>
        <span class="muted">{detail}</span>
      </span>
      {covered !== undefined && (
        <span class="row-figure" title={t('Coverage of scannable area')}>
          <span>{reachedPercent(covered.coverage, covered.required)}</span>
          <Meter fraction={covered.coverage} required={covered.required} />
        </span>
      )}
    </button>
  );
}

/** Spreading concerns all floors; the height of the cut every opened one. */
function CutControl({ store }: { store: Store }) {
  const floors = store.loaded.value?.stage.floors ?? [];
  const chosen = floors.find((floor) => floor.id === store.floorId.value);
  const isOpen = chosen !== undefined || store.isSpread.value;
  const highest = Math.max(LOWEST_CUT_M, ...(chosen ? [chosen] : floors).map(highestCutM));
  const cutM = Math.min(store.cutM.value, highest);
  const off = whyNoPicture(store);
  return (
    <fieldset class="controls" disabled={off !== null} title={off ?? undefined}>
      {chosen === undefined && (
        <label class="check">
          <input
            type="checkbox"
            checked={store.isSpread.value}
            onChange={(event) => {
              store.isSpread.value = event.currentTarget.checked;
            }}
          />
          {t('Spread floors apart')}
        </label>
      )}
      <label class="check">
        <input
          type="checkbox"
          checked={store.hidesCeilings.value}
          onChange={(event) => {
            store.hidesCeilings.value = event.currentTarget.checked;
            // Below a low cut there are no ceilings to hide: show the walls in their full height, and only for as long.
            if (event.currentTarget.checked) store.cutM.value = Math.max(store.cutM.value, highest);
            else if (store.cutM.value >= highest) store.cutM.value = DEFAULT_CUT_M;
          }}
        />
        {t('Hide ceilings and roofs')}
      </label>
      {isOpen && (
        <label class="slider">
          <span>{t('Cut above floor')}</span>
          <output>{lengthWords(cutM, 1)}</output>
          <input
            type="range"
            aria-label={t('Height of the cut above the floor')}
            min={LOWEST_CUT_M}
            max={highest}
            step={0.05}
            value={cutM}
            onInput={(event) => {
              store.cutM.value = event.currentTarget.valueAsNumber;
            }}
          />
        </label>
      )}
    </fieldset>
  );
}
