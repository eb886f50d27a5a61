/** The figures of the chosen station. */
import type { PlanJson, PlanLink, PlanStation } from '../load/plan-json.ts';
import { Card } from '../panels/card.tsx';
import { counted, metres, percent, squareMetres, whole } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { CloudPaint, CloudState, Store } from '../store.ts';

export function StationCard({ store }: { store: Store }) {
  const plan = store.loaded.value?.plan;
  const station = plan?.stations.find(({ id }) => id === store.stationId.value);
  if (plan === undefined || station === undefined) return null;
  const floor = plan.floors.find(({ id }) => id === station.floor);
  const [x, y, z] = station.position;
  return (
    <Card
      title={`Station ${station.id}`}
      subtitle={`${floor?.name ?? station.floor} · ${station.order} of ${plan.stations.length}${station.fixed ? ' · fixed' : ''}`}
      name="Chosen station"
      onClose={() => store.chooseStation(null)}
    >
      <dl class="figures" data-testid="station-figures">
        <Figure name="x" value={metres(x, 3)} hint="Sensor's origin in the scene's own coordinates" />
        <Figure name="y" value={metres(y, 3)} hint="Sensor's origin in the scene's own coordinates" />
        <Figure name="z" value={metres(z, 3)} hint="Sensor's origin in the scene's own coordinates" />
        <Figure name="Instrument height" value={metres(station.instrument_height_m)} hint="Sensor above the ground" />
        <Figure name="Sees" value={squareMetres(station.covered_area_m2)} hint="Area this station sees by itself" />
        <Figure
          name="Only it sees"
          value={squareMetres(station.own_area_m2)}
          hint="Area that no other station of the plan sees"
        />
      </dl>
      <Links store={store} plan={plan} station={station} />
      <CloudControl store={store} cloud={store.cloud.value} />
    </Card>
  );
}

function Links({ store, plan, station }: { store: Store; plan: PlanJson; station: PlanStation }) {
  const { links, threshold } = plan.registration;
  const own = links
    .filter((link) => link.a === station.id || link.b === station.id)
    .sort((a, b) => b.overlap - a.overlap);
  const strong = own.filter((link) => link.overlap >= threshold);
  const otherEnd = (link: PlanLink): string => (link.a === station.id ? link.b : link.a);
  return (
    <div class="links">
      <h3>
        {counted(strong.length, 'link')} of at least {percent(threshold, 0)} overlap
      </h3>
      <ul>
        {own.slice(0, 8).map((link) => (
          <li key={otherEnd(link)}>
            <button
              type="button"
              class={link.overlap >= threshold ? 'chip chip-strong' : 'chip'}
              title={link.overlap >= threshold ? 'Enough to register' : 'Too little to register'}
              onClick={() => store.chooseStation(otherEnd(link))}
            >
              {otherEnd(link)} <span>{percent(link.overlap, 0)}</span>
            </button>
          </li>
        ))}
      </ul>
    </div>
  );
}

function CloudControl({ store, cloud }: { store: Store; cloud: CloudState }) {
  const paints: CloudPaint[] = ['range', 'intensity'];
  return (
    <div class="cloud" data-testid="cloud" data-state={cloud.kind}>
      {cloud.kind === 'loading' && <p class="muted">Loading its cloud …</p>}
      {cloud.kind === 'failed' && <p class="note note-warn">{cloud.message}</p>}
      {cloud.kind === 'shown' && (
        <>
          <span class="muted">{whole(cloud.nReturns)} returns, by</span>
          <div class="segments" role="radiogroup" aria-label="Colour of the cloud">
            {paints.map((paint) => (
              // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
              <button
                key={paint}
                type="button"
                role="radio"
                aria-checked={store.cloudPaint.value === paint}
                onClick={() => {
                  store.cloudPaint.value = paint;
                }}
              >
                {paint === 'range' ? 'Range' : 'Intensity'}
              </button>
            ))}
          </div>
        </>
      )}
    </div>
  );
}
