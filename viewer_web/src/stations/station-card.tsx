/** All about the chosen station: where it stands, what only it sees, what it registers with, what it takes. */
import type { PlanJson, PlanLink, PlanStation } from '../load/plan-json.ts';
import { countingOf, counts } from '../network/graph.ts';
import { Card } from '../panels/card.tsx';
import { askedPercent, counted, duration, metres, overlapPercent, squareMetres } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { CloudControl } from './cloud-control.tsx';

/** More chips than these are in the tab Network. */
const MOST_LINKS = 8;

interface StationProps {
  readonly store: Store;
  readonly plan: PlanJson;
  readonly station: PlanStation;
}

export function StationCard({ store, view }: { store: Store; view: PlanView | null }) {
  const plan = store.loaded.value?.plan;
  const station = plan?.stations.find(({ id }) => id === store.stationId.value);
  if (plan === undefined || station === undefined) return null;
  const floor = plan.floors.find(({ id }) => id === station.floor);
  return (
    <Card
      title={`Station ${station.id}`}
      subtitle={`${floor?.name ?? station.floor} · ${station.order} of ${plan.stations.length}${station.fixed ? ' · fixed' : ''}`}
      name="Chosen station"
      onClose={() => store.chooseStation(null)}
    >
      <Pose plan={plan} station={station} store={store} />
      <OwnSurface store={store} plan={plan} station={station} />
      <Links store={store} plan={plan} station={station} />
      <div class="chips">
        <button
          type="button"
          class="chip chip-strong"
          onClick={() => {
            store.sheet.value = 'panorama';
          }}
        >
          Panorama
        </button>
        <button type="button" class="chip chip-strong" onClick={() => view?.standAt(station.id)}>
          Stand there
        </button>
      </div>
      <CloudControl store={store} />
    </Card>
  );
}

function Pose({ plan, station }: StationProps) {
  const [x, y, z] = station.position;
  const seconds = secondsAt(plan);
  return (
    <dl class="figures" data-testid="station-figures">
      <Figure name="x" value={metres(x, 3)} hint="Sensor's origin in the scene's own coordinates" />
      <Figure name="y" value={metres(y, 3)} hint="Sensor's origin in the scene's own coordinates" />
      <Figure name="z" value={metres(z, 3)} hint="Sensor's origin in the scene's own coordinates" />
      <Figure name="Instrument height" value={metres(station.instrument_height_m)} hint="Sensor above the ground" />
      <Figure name="Sees" value={squareMetres(station.covered_area_m2)} hint="Area this station sees by itself" />
      {seconds !== null && (
        <Figure name="Time" value={duration(seconds)} hint="Setting up and scanning, without the walk" />
      )}
      <Figure name={ownName(plan)} value={squareMetres(station.own_area_m2)} hint={ownHint(plan)} />
    </dl>
  );
}

/** Where several stations must see a surface, it needs a station as soon as no more than so many do. */
function ownName({ requirements: { seen_from: seenFrom = 1 } }: PlanJson): string {
  return seenFrom > 1 ? 'Needs it' : 'Only it sees';
}

function ownHint({ requirements: { seen_from: seenFrom = 1 } }: PlanJson): string {
  return seenFrom > 1
    ? `Area that ${seenFrom} stations see, as is asked for, and it is one of them`
    : 'Area that no other station of the plan sees';
}

/** Set-up and scan of one station; null: it is not known how long a scan takes. */
function secondsAt({ field_time: time, stations }: PlanJson): number | null {
  const nScanned = stations.filter(({ fixed }) => !fixed).length;
  if (!time || time.scanning_s === null || time.set_up_s === null || nScanned === 0) return null;
  return (time.scanning_s + time.set_up_s) / nScanned;
}

/** The largest of what would be lost without the station, and a button that points it out. */
function OwnSurface({ store, plan, station }: StationProps) {
  const parts = plan.why?.stations.find((one) => one.station === station.id)?.own_parts ?? [];
  return (
    <div class="own">
      {parts.length > 0 && (
        <ul class="muted">
          {parts.slice(0, 3).map((part) => (
            <li key={`${part.name} ${part.room?.name}`}>
              <span title={part.name}>
                {[part.name || 'Unnamed element', part.room?.name].filter(Boolean).join(' · ')}
              </span>
              <span>{squareMetres(part.area_m2)}</span>
            </li>
          ))}
        </ul>
      )}
      <label class="check">
        <input
          type="checkbox"
          checked={store.showsOwn.value}
          onChange={(event) => {
            store.showsOwn.value = event.currentTarget.checked;
          }}
        />
        Point out what {(plan.requirements.seen_from ?? 1) > 1 ? 'needs it' : 'only it sees'}
      </label>
    </div>
  );
}

function Links({ store, plan, station }: StationProps) {
  const counting = countingOf(plan);
  const own = store.shownLinks.value
    .filter((link) => link.a === station.id || link.b === station.id)
    .sort((a, b) => b.overlap - a.overlap);
  const strong = own.filter((link) => counts(link, counting));
  const otherEnd = (link: PlanLink): string => (link.a === station.id ? link.b : link.a);
  return (
    <div class="links">
      <h3>
        {counted(strong.length, 'link')} of at least {askedPercent(counting.threshold)} overlap
      </h3>
      <ul class="chips">
        {own.slice(0, MOST_LINKS).map((link) => (
          <li key={otherEnd(link)}>
            <button
              type="button"
              class={strong.includes(link) ? 'chip chip-strong' : 'chip'}
              title={strong.includes(link) ? 'Enough to register; show what is shared' : 'Too little to register'}
              onClick={() => store.choosePair([station.id, otherEnd(link)])}
            >
              {otherEnd(link)} <span>{overlapPercent(link.overlap)}</span>
            </button>
          </li>
        ))}
      </ul>
    </div>
  );
}
