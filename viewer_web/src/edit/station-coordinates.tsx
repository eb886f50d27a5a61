/** Where the chosen station stands, typed in scene or site coordinates, and moved in small steps. */
import { useSignal } from '@preact/signals';
import { type Site, siteOf, siteUnitM } from '../measure/site.ts';
import { lengthWords } from '../panels/figures.ts';
import { LengthField } from '../panels/length-field.tsx';
import type { Store } from '../store.ts';
import type { DraftStation } from './draft.ts';
import { NUDGE_M } from './keys.ts';
import { isLive } from './readiness.ts';

export function StationCoordinates({ store, station }: { store: Store; station: DraftStation }) {
  const isSite = useSignal(false);
  const scene = store.loaded.value?.plan.scene;
  const site = scene === undefined ? null : siteOf(scene);
  const moving = store.editing.underWay.value;
  const sceneM = moving?.stationId === station.id ? moving.positionM : station.positionM;
  const isOff = !isLive(store) || station.isLocked;
  return (
    <div class="station-coordinates">
      {site !== null && <SystemChoice site={site} isSite={isSite.value} onChoice={(one) => (isSite.value = one)} />}
      <Fields store={store} station={station} sceneM={sceneM} site={isSite.value ? site : null} isOff={isOff} />
      <Nudges store={store} station={station} isOff={isOff} />
    </div>
  );
}

interface SystemChoiceProps {
  readonly site: Site;
  readonly isSite: boolean;
  readonly onChoice: (isSite: boolean) => void;
}

function SystemChoice({ site, isSite, onChoice }: SystemChoiceProps) {
  return (
    <div class="segments" role="radiogroup" aria-label="Coordinates">
      {[false, true].map((one) => (
        // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
        <button
          key={String(one)}
          type="button"
          role="radio"
          aria-checked={isSite === one}
          title={one ? site.name : 'Coordinates of the scene file'}
          onClick={() => onChoice(one)}
        >
          {one ? 'Site' : 'Scene'}
        </button>
      ))}
    </div>
  );
}

interface FieldsProps {
  readonly store: Store;
  readonly station: DraftStation;
  readonly sceneM: DraftStation['positionM'];
  /** Null: scene coordinates. */
  readonly site: Site | null;
  readonly isOff: boolean;
}

function Fields({ store, station, sceneM, site, isOff }: FieldsProps) {
  const shownM = site === null ? sceneM : site.toSite(sceneM);
  const names = site === null ? ['x', 'y', 'z of the sensor'] : ['Easting', 'Northing', 'Height of the sensor'];
  return (
    <div class="fields-three">
      {names.map((name, k) => (
        <LengthField
          key={name}
          label={name}
          valueM={shownM[k]}
          {...(site === null ? {} : { unitM: siteUnitM(site) })}
          disabled={isOff}
          onValue={(typedM) => {
            const typed = shownM.map((m, i) => (i === k ? typedM : m)) as unknown as typeof sceneM;
            const toM = site === null ? typed : site.toScene(typed);
            void store.editing.editor.peek()?.mover.place(station, toM);
          }}
        />
      ))}
    </div>
  );
}

const NUDGES = [
  ['←', 'west', -1, 0],
  ['↑', 'north', 0, 1],
  ['↓', 'south', 0, -1],
  ['→', 'east', 1, 0],
] as const;

function Nudges({ store, station, isOff }: { store: Store; station: DraftStation; isOff: boolean }) {
  const mover = store.editing.editor.value?.mover;
  return (
    <fieldset class="nudges" aria-label="Move the station in steps">
      <span class="muted">{lengthWords(NUDGE_M)} (Shift and arrows)</span>
      {NUDGES.map(([sign, name, east, north]) => (
        <button
          key={name}
          type="button"
          class="icon"
          disabled={isOff || mover === undefined}
          aria-label={`Move ${lengthWords(NUDGE_M)} ${name}`}
          onClick={() => void mover?.nudge(station, east * NUDGE_M, north * NUDGE_M).then(() => mover.finish())}
        >
          {sign}
        </button>
      ))}
    </fieldset>
  );
}
