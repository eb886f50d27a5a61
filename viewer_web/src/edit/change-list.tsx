/** Everything that the review changes about the next plan, each with what takes it back. */

import type { Change, Review } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { lengthWords, percent } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { allow, type Entry, moveBack, removeStation, removeZone, restoreStation, unpickGround } from './changes.ts';
import type { DraftStation } from './draft.ts';
import { entranceEntries } from './entrance-parts.tsx';
import { stationsOf } from './review-stations.ts';

export function ChangeList({ store }: { store: Store }) {
  const { reviewClient } = store;
  const review = reviewClient?.review.value ?? null;
  if (reviewClient === null || review === null) return null;
  const floors = store.loaded.value?.plan.floors ?? [];
  const nameOf = (id: string): string =>
    id === '' ? t('all floors') : (floors.find((floor) => floor.id === id)?.name ?? id);
  const entries = [
    ...stationEntries(stationsOf(store), review, nameOf),
    ...areaEntries(review, nameOf),
    ...entranceEntries(review, store.loaded.value, nameOf),
  ];
  return (
    <Section title={t('Changes')} aside={entries.length === 0 ? '' : `${entries.length}`}>
      {entries.length === 0 && <p class="muted">{t('No changes yet.')}</p>}
      <ul class="entries" aria-label={t('Changes')}>
        {entries.map((entry) => (
          <li key={entry.key} class="entry">
            {entry.swatch !== null && <i class={`swatch ${entry.swatch}`} />}
            <span class="entry-main">
              <EntryTitle store={store} entry={entry} />
              <small>{entry.detail}</small>
            </span>
            <button
              type="button"
              class="button button-small button-quiet"
              aria-label={`${entry.backLabel}: ${entry.title}`}
              onClick={() => void reviewClient.commit(t('revert {title}', { title: entry.title }), [entry.back])}
            >
              {entry.backLabel}
            </button>
          </li>
        ))}
      </ul>
      {entries.length > 1 && (
        <div class="buttons">
          <button
            type="button"
            class="button button-small"
            onClick={() =>
              void reviewClient.commit(
                t('discard all changes'),
                entries.map(({ back }) => back),
              )
            }
          >
            {t('Discard all changes')}
          </button>
        </div>
      )}
    </Section>
  );
}

function EntryTitle({ store, entry }: { store: Store; entry: Entry }) {
  const { stationId, floorId } = entry;
  if (stationId === undefined && !floorId) return <span>{entry.title}</span>;
  return (
    <button
      type="button"
      class="link"
      onClick={() => (stationId === undefined ? store.chooseFloor(floorId ?? null) : store.chooseStation(stationId))}
    >
      {entry.title}
    </button>
  );
}

function stationEntries(stations: readonly DraftStation[], review: Review, nameOf: (floor: string) => string): Entry[] {
  return stations.flatMap((station): Entry[] => {
    const { id, movedFromM, floorId } = station;
    const entry = (title: string, detail: string, back: Change, backLabel: string): Entry => ({
      key: `${back.kind} ${id}`,
      title,
      detail,
      swatch: null,
      back,
      backLabel,
      stationId: id,
    });
    if (station.isRemoved) return [entry(t('{id} removed', { id }), nameOf(floorId), restoreStation(id), t('Restore'))];
    if (station.isAdded) return [entry(t('{id} added', { id }), nameOf(floorId), removeStation(id), t('Remove'))];
    const entries: Entry[] = [];
    if (movedFromM !== null) {
      const distanceM = Math.hypot(...station.positionM.map((value, i) => value - movedFromM[i]));
      entries.push(
        entry(
          t('{id} moved', { id }),
          t('by {length}, {floor}', { length: lengthWords(distanceM), floor: nameOf(floorId) }),
          moveBack(id),
          t('Move back'),
        ),
      );
    }
    const lock = review.stations[id]?.locked ?? null;
    if (lock !== null) {
      entries.push(
        entry(
          lock ? t('{id} locked', { id }) : t('{id} unlocked', { id }),
          nameOf(floorId),
          lockBack(id),
          lock ? t('Unlock') : t('Lock'),
        ),
      );
    }
    return entries;
  });
}

/** As the plan has it. */
function lockBack(station: string): Change {
  return { kind: 'lock_station', station, locked: null };
}

function zoneInWords({ kind, coverage }: Review['zones'][string], floor: string): string {
  if (kind !== 'priority') return t('keep-out, {floor}', { floor });
  if (coverage === null) return t('priority: {floor}', { floor });
  return t('priority: {coverage} required, {floor}', { coverage: percent(coverage, 0), floor });
}

function areaEntries(review: Review, nameOf: (floor: string) => string): Entry[] {
  const zones = Object.entries(review.zones).map(([id, zone]): Entry => {
    const isPriority = zone.kind === 'priority';
    return {
      key: `zone ${id}`,
      title: zone.name || (isPriority ? t('Priority zone') : t('Keep-out zone')),
      detail: zoneInWords(zone, nameOf(zone.floor)),
      swatch: `swatch-${zone.kind}`,
      back: removeZone(id),
      backLabel: t('Remove'),
      floorId: zone.floor,
    };
  });
  const forbidden = Object.entries(review.forbidden).map(
    ([id, place]): Entry => ({
      key: `forbidden ${id}`,
      title: t('Forbidden position'),
      detail: t('radius {length}, {floor}', { length: lengthWords(place.radius_m, 1), floor: nameOf(place.floor) }),
      swatch: 'swatch-forbidden',
      back: allow(id),
      backLabel: t('Allow'),
      floorId: place.floor,
    }),
  );
  const picks = Object.entries(review.ground_picks).map(
    ([id, pick]): Entry => ({
      key: `pick ${id}`,
      title: pick.is_ground ? t('Walkable floor') : t('Not a floor'),
      detail: pick.floor === '' ? t('nearest floor') : nameOf(pick.floor),
      swatch: pick.is_ground ? 'swatch-ground' : 'swatch-not_ground',
      back: unpickGround(id),
      backLabel: t('Unmark'),
      floorId: pick.floor,
    }),
  );
  return [...zones, ...forbidden, ...picks];
}
