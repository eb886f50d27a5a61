/** Several stations at once: moved together, locked, removed, each as one change that one undo takes back. */

import { useSignal } from '@preact/signals';
import type { Change } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { Card } from '../panels/card.tsx';
import { counted } from '../panels/figures.ts';
import { LengthField } from '../panels/length-field.tsx';
import { selectNone } from '../stations/select.ts';
import type { Store } from '../store.ts';
import { lockStation, removeStation } from './changes.ts';
import type { DraftStation } from './draft.ts';
import { canEdit, isLive, whyNoEditing, whyNotLive } from './readiness.ts';
import { selectedStations } from './selected.ts';

export function SelectionCard({ store }: { store: Store }) {
  const { selection, selectsSeveral, isWalking } = store;
  if ((selection.value.size === 0 && !selectsSeveral.value) || isWalking.value) return null;
  const stations = selectedStations(store);
  return (
    <Card
      title={t('{stations} selected', { stations: counted(stations.length, 'station') })}
      subtitle={stations.map(({ id }) => id).join(', ') || t('Click stations to select them')}
      name={t('Selected stations')}
      onClose={() => selectNone(store)}
    >
      {canEdit(store) ? <Actions store={store} stations={stations} /> : <p class="muted">{whyNoEditing(store)}</p>}
    </Card>
  );
}

function Actions({ store, stations }: { store: Store; stations: readonly DraftStation[] }) {
  const { reviewClient } = store;
  const free = stations.filter(({ isFixed }) => !isFixed);
  const removable = free.filter(({ isLocked }) => !isLocked);
  const commit = (words: string, of: readonly DraftStation[], change: (id: string) => Change): void => {
    void reviewClient?.commit(
      words,
      of.map(({ id }) => change(id)),
    );
  };
  const [locked, unlocked] = [free.filter(({ isLocked }) => isLocked), free.filter(({ isLocked }) => !isLocked)];
  return (
    <>
      {free.length < stations.length && (
        <p class="muted">
          {t('{stations} already scanned: left as they are.', {
            stations: counted(stations.length - free.length, 'station'),
          })}
        </p>
      )}
      <MoveAll store={store} stations={free} />
      <div class="buttons">
        <button
          type="button"
          class="button button-small"
          disabled={unlocked.length === 0}
          onClick={() =>
            commit(t('lock {stations}', { stations: counted(unlocked.length, 'station') }), unlocked, (id) =>
              lockStation(id, true),
            )
          }
        >
          {t('Lock')}
        </button>
        <button
          type="button"
          class="button button-small"
          disabled={locked.length === 0}
          onClick={() =>
            commit(t('unlock {stations}', { stations: counted(locked.length, 'station') }), locked, (id) =>
              lockStation(id, false),
            )
          }
        >
          {t('Unlock')}
        </button>
        <button
          type="button"
          class="button button-small"
          disabled={removable.length === 0}
          onClick={() => {
            commit(
              t('remove {stations}', { stations: counted(removable.length, 'station') }),
              removable,
              removeStation,
            );
            selectNone(store);
          }}
        >
          {t('Remove')}
        </button>
        {stations.length === 2 && (
          <button
            type="button"
            class="button button-small"
            onClick={() => {
              selectNone(store);
              store.choosePair([stations[0].id, stations[1].id]);
            }}
          >
            {t('Shared surface')}
          </button>
        )}
      </div>
    </>
  );
}

function MoveAll({ store, stations }: { store: Store; stations: readonly DraftStation[] }) {
  const [eastM, northM] = [useSignal(0), useSignal(0)];
  const mover = store.editing.editor.value?.mover;
  const isOff = !isLive(store) || mover === undefined || stations.length === 0;
  return (
    <form
      class="move-all"
      title={whyNotLive(store) ?? t('All together, along the axes of the scene; or drag one of them in the tab Edit')}
      onSubmit={(event) => {
        event.preventDefault();
        if (!isOff) void mover.moveAll(stations, eastM.peek(), northM.peek());
      }}
    >
      <LengthField
        label={t('East')}
        digits={2}
        valueM={eastM.value}
        disabled={isOff}
        onValue={(m) => (eastM.value = m)}
      />
      <LengthField
        label={t('North')}
        digits={2}
        valueM={northM.value}
        disabled={isOff}
        onValue={(m) => (northM.value = m)}
      />
      <button type="submit" class="button button-small" disabled={isOff}>
        {t('Move')}
      </button>
    </form>
  );
}
