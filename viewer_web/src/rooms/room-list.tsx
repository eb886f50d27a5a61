/** The list of rooms: how much of each is seen, what the rest lacks, and the stations in it. A click flies there. */

import { useEffect, useRef, useState } from 'preact/hooks';
import { reasonInWords } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import { areaWords, reachedPercent } from '../panels/figures.ts';
import { reveal } from '../panels/reveal.ts';
import { Section } from '../panels/section.tsx';
import { Meter } from '../panels/summary.tsx';
import type { Store } from '../store.ts';
import { type ReasonArea, type RoomFigures, worstFirst } from './rooms.ts';
import './rooms.css';

/** Of the rooms, the worst first: further down, nothing is wrong. */
const FEW = 6;

export function RoomList({ store }: { store: Store }) {
  const [showsAll, showAll] = useState(false);
  const { loaded, rooms, floorId, roomTrouble, roomNumber, showsRoomNames } = store;
  if (roomTrouble.value !== '')
    return (
      <Section title={t('Rooms')}>
        <p class="note note-warn">{roomTrouble.value}</p>
      </Section>
    );
  if (loaded.value === null || rooms.value === null || rooms.value.length === 0) return null;
  const here = worstFirst(rooms.value.filter(({ room }) => floorId.value === null || room.floor === floorId.value));
  const isNamed = rooms.value.some(({ room }) => room.name !== '');
  const chosen = here.findIndex(({ number }) => number === roomNumber.value);
  const shown = showsAll || chosen >= FEW ? here : here.slice(0, FEW);
  return (
    <Section title={t('Rooms')} aside={t('{n}, least covered first', { n: here.length })}>
      {!isNamed && <p class="note">{t('The file has no rooms: these are regions of free floor between doorways.')}</p>}
      <ul class="rows" aria-label={t('Rooms')}>
        {shown.map((room) => (
          <Row
            key={room.number}
            store={store}
            figures={room}
            required={loaded.value?.plan.requirements.coverage ?? 0}
          />
        ))}
      </ul>
      {here.length > shown.length && (
        <button type="button" class="more" onClick={() => showAll(true)}>
          {t('Show all {n} rooms', { n: here.length })}
        </button>
      )}
      {here.length === 0 && <p class="muted">{t('No rooms on this floor.')}</p>}
      <label class="check room-names-check">
        <input
          type="checkbox"
          checked={showsRoomNames.value}
          onChange={(event) => {
            showsRoomNames.value = event.currentTarget.checked;
          }}
        />
        {t('Names of rooms in the picture')}
      </label>
    </Section>
  );
}

function Row({ store, figures, required }: { store: Store; figures: RoomFigures; required: number }) {
  const { number, name, coverage, scannableM2, unseen, hidden } = figures;
  const isChosen = store.roomNumber.value === number;
  const stations = store.stationsOfRooms.value.get(number) ?? [];
  const row = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (isChosen) reveal(row.current);
  }, [isChosen]);
  const wordsOf = ({ reason, areaM2 }: ReasonArea) => ({ area: areaWords(areaM2), reason: reasonInWords(reason) });
  return (
    <li>
      <button
        ref={row}
        type="button"
        class={isChosen ? 'row row-chosen' : 'row'}
        aria-pressed={isChosen}
        data-room={number}
        onClick={() => store.chooseRoom(isChosen ? null : number)}
      >
        <span class="row-main">
          <span class="row-name">{name}</span>
          <span class="muted room-about">{stations.length === 0 ? t('no station') : stations.join(' ')}</span>
          {unseen !== null && <span class="muted room-about">{t('unseen: {area} {reason}', wordsOf(unseen))}</span>}
          {hidden !== null && (
            <span class="muted room-about">{t('not scannable: {area} {reason}', wordsOf(hidden))}</span>
          )}
        </span>
        <span
          class="row-figure"
          title={t('Coverage of the {area} of the room that are scannable', { area: areaWords(scannableM2) })}
        >
          <span>{coverage === null ? '–' : reachedPercent(coverage, required)}</span>
          <Meter fraction={coverage ?? 0} required={required} />
        </span>
      </button>
    </li>
  );
}
