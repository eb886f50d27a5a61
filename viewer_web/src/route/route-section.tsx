/** The route from station to station: how long, and one stop after the other. */
import { t } from '../language/language.ts';
import { alongWays, duration, lengthWords } from '../panels/figures.ts';
import { Figure, Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { missesEntrance, type Stop, stopsOf } from './route.ts';

export function RouteSection({ store }: { store: Store }) {
  const route = store.shownRoute.value;
  const time = store.shownTime.value;
  if (route === null) {
    return (
      <Section title={t('Route')}>
        <p class="muted">{t('No route was computed for this plan.')}</p>
      </Section>
    );
  }
  const stops = stopsOf(route);
  const nEntrances = Object.keys(store.reviewClient?.review.value?.entrances ?? {}).length;
  const at = stops.findIndex(({ station }) => station === store.stationId.value);
  const go = (stop: Stop | undefined): void => {
    if (stop === undefined) return;
    store.showRoute.value = true;
    store.chooseStation(stop.station);
  };
  return (
    <Section title={t('Route')} aside={alongWays(lengthWords(route.length_m, 0), route.n_unwalkable)}>
      <dl class="figures">
        {time !== null && time.total_s !== null && (
          <Figure
            name={t('Field time')}
            value={alongWays(duration(time.total_s), route.n_unwalkable)}
            hint={t('Walking, setup and scans')}
          />
        )}
        {route.left_out.length > 0 && (
          <Figure
            name={t('Not reachable on foot')}
            value={route.left_out.join(', ')}
            hint={t('No path inside the model leads there')}
          />
        )}
      </dl>
      {missesEntrance(store.draftRoute.value?.route ?? null, nEntrances) && (
        <p class="note">
          {t(
            'The entrance is on ground that this plan does not reach: the route begins wherever it is shortest. Plan again to begin there, or move the entrance.',
          )}
        </p>
      )}
      {isOfOtherStations(store) && (
        <p class="note">{t('Stations were edited in the review: this is the route of the original plan.')}</p>
      )}
      <label class="check">
        <input
          type="checkbox"
          checked={store.showRoute.value}
          onChange={(event) => {
            store.showRoute.value = event.currentTarget.checked;
          }}
        />
        {t('Show route')}
      </label>
      <div class="route-steps">
        <button
          type="button"
          class="chip"
          disabled={at === 0}
          onClick={() => go(stops[at < 0 ? stops.length - 1 : at - 1])}
        >
          {t('‹ Previous')}
        </button>
        <span aria-live="polite">
          {at < 0 ? t('{n} stops', { n: stops.length }) : t('stop {n} of {all}', { n: at + 1, all: stops.length })}
        </span>
        <button type="button" class="chip" disabled={at === stops.length - 1} onClick={() => go(stops[at + 1])}>
          {t('Next ›')}
        </button>
      </div>
      {at >= 0 && <p class="note">{inWords(stops[at])}</p>}
    </Section>
  );
}

/** The route of the draft is not there: it is under way, or nobody computes it. */
function isOfOtherStations(store: Store): boolean {
  return store.draft.value !== null && store.draftRoute.value === null;
}

function inWords({ station, from, lengthM, changesFloor, leg }: Stop): string {
  if (leg === null) return t('The route starts at {station}.', { station });
  const source = from ?? t('the entrance');
  if (lengthM === null) return t('No path inside the model leads from {source} to {station}.', { source, station });
  const ends = { length: lengthWords(lengthM, 1), source, station };
  return changesFloor
    ? t('{length} from {source} to {station}, by the stairs.', ends)
    : t('{length} from {source} to {station}.', ends);
}
