/** The chosen station: its height, and what may be done with it. */

import { batch } from '@preact/signals';
import { t } from '../language/language.ts';
import { SetUpDistances } from '../measure/set-up-lines.tsx';
import { lengthWords } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { forbid, lockStation, moveBack, removeStation, restoreStation } from './changes.ts';
import type { DraftStation } from './draft.ts';
import { isLive } from './readiness.ts';
import { stationsOf } from './review-stations.ts';
import { StationCoordinates } from './station-coordinates.tsx';

/** Of tripods, where the scanner does not say. */
const USUAL_HEIGHTS_M = [0.5, 2] as const;
const STEP_M = 0.01;

export function StationEditing({ store }: { store: Store }) {
  const station = stationsOf(store).find(({ id }) => id === store.stationId.value);
  if (station === undefined) {
    return (
      <Section title={t('Station')}>
        <p class="muted">{t('Select a station in the model or in the list.')}</p>
      </Section>
    );
  }
  return (
    <Section title={t('Station {id}', { id: station.id })} aside={stateInWords(station)}>
      {station.isFixed ? (
        <p class="muted">{t('Already scanned: its position can’t be changed.')}</p>
      ) : (
        <>
          {!station.isRemoved && <HeightSlider store={store} station={station} />}
          {!station.isRemoved && <StationCoordinates store={store} station={station} />}
          {!station.isRemoved && <SetUpDistances store={store} />}
          <StationButtons store={store} station={station} />
        </>
      )}
    </Section>
  );
}

function stateInWords(station: DraftStation): string {
  const words = [
    station.isFixed && t('scanned'),
    station.isRemoved && t('removed'),
    station.isAdded && t('added'),
    station.movedFromM !== null && !station.isRemoved && t('moved'),
    station.isLocked && t('locked'),
  ].filter((word) => word !== false);
  return words.join(', ');
}

function HeightSlider({ store, station }: { store: Store; station: DraftStation }) {
  const scanner = store.loaded.value?.plan.scanner;
  const mover = store.editing.editor.value?.mover;
  const moving = store.editing.underWay.value;
  const heightM = (moving?.stationId === station.id ? moving.heightM : station.instrumentHeightM) ?? null;
  if (heightM === null) return <p class="muted">{t('Instrument height unknown.')}</p>;
  const low = scanner?.instrument_height_min_m ?? USUAL_HEIGHTS_M[0];
  const high = scanner?.instrument_height_max_m ?? USUAL_HEIGHTS_M[1];
  return (
    <label class="slider">
      <span>{t('Instrument height')}</span>
      <output>{lengthWords(heightM)}</output>
      <input
        type="range"
        aria-label={t('Instrument height above the ground')}
        min={Math.min(low, heightM)}
        max={Math.max(high, heightM)}
        step={STEP_M}
        value={heightM}
        disabled={!isLive(store) || low === high || station.isLocked}
        onInput={(event) => mover?.raise(station, event.currentTarget.valueAsNumber)}
        onChange={() => void mover?.finish()}
      />
    </label>
  );
}

function StationButtons({ store, station }: { store: Store; station: DraftStation }) {
  const { reviewClient } = store;
  if (reviewClient === null) return null;
  const { id } = station;
  if (station.isRemoved) {
    return (
      <div class="buttons">
        <button
          type="button"
          class="button"
          onClick={() => void reviewClient.commit(t('restore {id}', { id }), [restoreStation(id)])}
        >
          {t('Restore')}
        </button>
      </div>
    );
  }
  const lockWords = station.isLocked ? t('unlock {id}', { id }) : t('lock {id}', { id });
  return (
    <div class="buttons">
      <button
        type="button"
        class="button button-small"
        title={t('A locked station stays where it is, in every new plan too')}
        aria-pressed={station.isLocked}
        onClick={() => void reviewClient.commit(lockWords, [lockStation(id, !station.isLocked)])}
      >
        {station.isLocked ? t('Unlock') : t('Lock')}
      </button>
      {station.movedFromM !== null && !station.isLocked && (
        <button
          type="button"
          class="button button-small"
          onClick={() => void reviewClient.commit(t('move {id} back', { id }), [moveBack(id)])}
        >
          {t('Move back')}
        </button>
      )}
      <button
        type="button"
        class="button button-small"
        title={
          station.isLocked
            ? t('Unlock the station first: it stands here')
            : t('New plans keep stations away from this position, within the radius')
        }
        disabled={station.isLocked}
        onClick={() =>
          void reviewClient.commit(t('forbid a position'), [
            forbid(station.positionM, store.editing.forbidRadiusM.peek(), station.floorId),
          ])
        }
      >
        {t('Forbid this position')}
      </button>
      <button
        type="button"
        class="button button-small"
        onClick={() =>
          batch(() => {
            const positionM = station.positionM;
            store.editing.commentSpot.value = { target: id, positionM, title: t('station {id}', { id }) };
            store.tab.value = 'review';
          })
        }
      >
        {t('Comment')}
      </button>
      <button
        type="button"
        class="button button-small"
        title={station.isLocked ? t('Unlock the station first: it stands here') : t('The new plan does without it')}
        disabled={station.isLocked}
        onClick={() => void reviewClient.commit(t('remove {id}', { id }), [removeStation(id)])}
      >
        {t('Remove')}
      </button>
    </div>
  );
}
