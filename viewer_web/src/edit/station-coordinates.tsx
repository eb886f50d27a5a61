/** Where the chosen station stands, typed in scene or site coordinates, and moved in small steps. */

import { useSignal } from '@preact/signals';
import { t } from '../language/language.ts';
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
    <div class="segments" role="radiogroup" aria-label={t('Coordinates')}>
      {[false, true].map((one) => (
        // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
        <button
          key={String(one)}
          type="button"
          role="radio"
          aria-checked={isSite === one}
          title={one ? site.name : t('Coordinates of the scene file')}
          onClick={() => onChoice(one)}
        >
          {one ? t('Site') : t('Scene')}
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
  const names =
    site === null ? ['x', 'y', t('z of the sensor')] : [t('Easting'), t('Northing'), t('Height of the sensor')];
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
  ['←', t('west'), -1, 0],
  ['↑', t('north'), 0, 1],
  ['↓', t('south'), 0, -1],
  ['→', t('east'), 1, 0],
] as const;

function Nudges({ store, station, isOff }: { store: Store; station: DraftStation; isOff: boolean }) {
  const mover = store.editing.editor.value?.mover;
  return (
    <fieldset class="nudges" aria-label={t('Move the station in steps')}>
      <span class="muted">{t('{length} (Shift and arrows)', { length: lengthWords(NUDGE_M) })}</span>
      {NUDGES.map(([sign, name, east, north]) => (
        <button
          key={name}
          type="button"
          class="icon"
          disabled={isOff || mover === undefined}
          aria-label={t('Move {length} {direction}', { length: lengthWords(NUDGE_M), direction: name })}
          onClick={() => void mover?.nudge(station, east * NUDGE_M, north * NUDGE_M).then(() => mover.finish())}
        >
          {sign}
        </button>
      ))}
    </fieldset>
  );
}
