/** Everything that the review changes about the next plan, each with what takes it back. */
import type { Change, Review } from '../api/documents.ts';
import { lengthWords, percent } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { allow, type Entry, moveBack, removeStation, removeZone, restoreStation, unpickGround } from './changes.ts';
import type { DraftStation } from './draft.ts';
import { stationsOf } from './draft-follower.ts';
import { entranceEntries } from './entrance-parts.tsx';

export function ChangeList({ store }: { store: Store }) {
  const { reviewClient } = store;
  const review = reviewClient?.review.value ?? null;
  if (reviewClient === null || review === null) return null;
  const floors = store.loaded.value?.plan.floors ?? [];
  const nameOf = (id: string): string =>
    id === '' ? 'all floors' : (floors.find((floor) => floor.id === id)?.name ?? id);
  const entries = [
    ...stationEntries(stationsOf(store), review, nameOf),
    ...areaEntries(review, nameOf),
    ...entranceEntries(review, store.loaded.value, nameOf),
  ];
  return (
    <Section title="Changes" aside={entries.length === 0 ? '' : `${entries.length}`}>
      {entries.length === 0 && <p class="muted">No changes yet.</p>}
      <ul class="entries" aria-label="Changes">
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
              onClick={() => void reviewClient.commit(`revert ${entry.title}`, [entry.back])}
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
                'discard all changes',
                entries.map(({ back }) => back),
              )
            }
          >
            Discard all changes
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
    if (station.isRemoved) return [entry(`${id} removed`, nameOf(floorId), restoreStation(id), 'Restore')];
    if (station.isAdded) return [entry(`${id} added`, nameOf(floorId), removeStation(id), 'Remove')];
    const entries: Entry[] = [];
    if (movedFromM !== null) {
      const distanceM = Math.hypot(...station.positionM.map((value, i) => value - movedFromM[i]));
      entries.push(entry(`${id} moved`, `by ${lengthWords(distanceM)}, ${nameOf(floorId)}`, moveBack(id), 'Move back'));
    }
    const lock = review.stations[id]?.locked ?? null;
    if (lock !== null) {
      entries.push(
        entry(`${id} ${lock ? 'locked' : 'unlocked'}`, nameOf(floorId), lockBack(id), lock ? 'Unlock' : 'Lock'),
      );
    }
    return entries;
  });
}

/** As the plan has it. */
function lockBack(station: string): Change {
  return { kind: 'lock_station', station, locked: null };
}

function areaEntries(review: Review, nameOf: (floor: string) => string): Entry[] {
  const zones = Object.entries(review.zones).map(([id, zone]): Entry => {
    const isPriority = zone.kind === 'priority';
    const asked = zone.coverage === null ? '' : `${percent(zone.coverage, 0)} required, `;
    return {
      key: `zone ${id}`,
      title: zone.name || (isPriority ? 'Priority zone' : 'Keep-out zone'),
      detail: isPriority ? `priority: ${asked}${nameOf(zone.floor)}` : `keep-out, ${nameOf(zone.floor)}`,
      swatch: `swatch-${zone.kind}`,
      back: removeZone(id),
      backLabel: 'Remove',
      floorId: zone.floor,
    };
  });
  const forbidden = Object.entries(review.forbidden).map(
    ([id, place]): Entry => ({
      key: `forbidden ${id}`,
      title: 'Forbidden position',
      detail: `radius ${lengthWords(place.radius_m, 1)}, ${nameOf(place.floor)}`,
      swatch: 'swatch-forbidden',
      back: allow(id),
      backLabel: 'Allow',
      floorId: place.floor,
    }),
  );
  const picks = Object.entries(review.ground_picks).map(
    ([id, pick]): Entry => ({
      key: `pick ${id}`,
      title: pick.is_ground ? 'Walkable floor' : 'Not a floor',
      detail: pick.floor === '' ? 'nearest floor' : nameOf(pick.floor),
      swatch: pick.is_ground ? 'swatch-ground' : 'swatch-not_ground',
      back: unpickGround(id),
      backLabel: 'Unmark',
      floorId: pick.floor,
    }),
  );
  return [...zones, ...forbidden, ...picks];
}
