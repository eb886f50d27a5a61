/** All about the chosen station: where it stands, what would be lost without it, what it registers with, what it takes. */

import { batch } from '@preact/signals';
import type { DraftStation } from '../edit/draft.ts';
import { stationsOf } from '../edit/review-stations.ts';
import { t } from '../language/language.ts';
import type { PlanJson, PlanLink, RequirementResult, StationLoss } from '../load/plan-json.ts';
import { SetUpDistances } from '../measure/set-up-lines.tsx';
import { countingOf, linkPercent, needsWords } from '../network/graph.ts';
import { lackInWords } from '../network/link-groups.ts';
import { Card } from '../panels/card.tsx';
import { areaWords, coordinateWords, counted, duration, heightWords, overlapNoun } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import { ProgressButtons } from '../review/progress-sign.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { CloudControl } from './cloud-control.tsx';
import './losses.css';
import { lossWords, lostM2, requirementName, verdictOf } from './losses.ts';
import type { StationWorth } from './shown.ts';

/** More chips than these are in the tab Network. */
const MOST_LINKS = 8;

interface StationProps {
  readonly store: Store;
  readonly plan: PlanJson;
  /** As edited. */
  readonly station: DraftStation;
}

export function StationCard({ store, view }: { store: Store; view: PlanView | null }) {
  const plan = store.loaded.value?.plan;
  const stations = stationsOf(store);
  const station = stations.find(({ id }) => id === store.stationId.value);
  if (plan === undefined || station === undefined || station.isRemoved) return null;
  const floor = plan.floors.find(({ id }) => id === station.floorId);
  const off = whyNoPicture(store);
  return (
    <Card
      title={t('Station {id}', { id: station.id })}
      subtitle={[
        floor?.name ?? station.floorId,
        t('{n} of {all}', { n: station.order, all: stations.filter(({ isRemoved }) => !isRemoved).length }),
        ...(station.isAdded ? [t('added')] : []),
        ...(station.isFixed ? [t('scanned')] : []),
        ...(station.movedFromM === null ? [] : [t('moved')]),
      ].join(' · ')}
      name={t('Chosen station')}
      onClose={() => store.chooseStation(null)}
    >
      <ProgressButtons store={store} stationId={station.id} />
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
          {t('Panorama')}
        </button>
        <button
          type="button"
          class="chip chip-strong"
          disabled={off !== null}
          title={off ?? undefined}
          onClick={() => view?.standAt(station.id)}
        >
          {t('View from here')}
        </button>
      </div>
      <SetUpDistances store={store} />
      {off === null && <CloudControl store={store} />}
    </Card>
  );
}

function Pose({ store, plan, station }: StationProps) {
  const [x, y, z] = station.positionM;
  const [worth, words] = [worthOf(store, plan, station), lossWords(plan)];
  const seconds = secondsAt(plan);
  return (
    <dl class="figures" data-testid="station-figures">
      <Figure name="x" value={coordinateWords(x, 3)} hint={t('Sensor origin, scene coordinates')} />
      <Figure name="y" value={coordinateWords(y, 3)} hint={t('Sensor origin, scene coordinates')} />
      <Figure name="z" value={coordinateWords(z, 3)} hint={t('Sensor origin, scene coordinates')} />
      <Figure
        name={t('Instrument height')}
        value={heightWords(station.instrumentHeightM)}
        hint={t('Sensor above the ground')}
      />
      <Figure
        name={t('Seen area')}
        value={worth === null ? t('unknown') : areaWords(worth.covered_area_m2)}
        hint={t('Area this station sees by itself')}
      />
      {seconds !== null && (
        <Figure
          name={t('Time on station')}
          value={duration(seconds)}
          hint={t('Setup and scan, without the way there')}
        />
      )}
      <Figure
        name={words.name}
        value={worth === null ? t('unknown') : areaWords(lostM2(plan, worth))}
        hint={words.hint}
      />
    </dl>
  );
}

/** Of the plan as shown: what is edited changes what every station is worth. Null: it is not known yet. */
function worthOf(store: Store, plan: PlanJson, { id, isAdded, movedFromM }: DraftStation): StationWorth | null {
  const edited = store.shownStations.value.find((one) => one.id === id)?.worth;
  if (edited !== undefined || isAdded || movedFromM !== null) return edited ?? null;
  return plan.stations.find((one) => one.id === id) ?? null;
}

/** Set-up and scan of one station; null: it is not known how long a scan takes. */
function secondsAt({ field_time: time, stations }: PlanJson): number | null {
  const nScanned = stations.filter(({ fixed }) => !fixed).length;
  if (!time || time.scanning_s === null || time.set_up_s === null || nScanned === 0) return null;
  return (time.scanning_s + time.set_up_s) / nScanned;
}

/** The largest of what would be lost without the station, and a box that highlights it. */
function OwnSurface({ store, plan, station }: StationProps) {
  const worth = worthOf(store, plan, station);
  const isAsPlanned = plan.stations.some((one) => one === worth);
  const results = isAsPlanned ? plan.requirements.results : store.reviewClient?.figures.value?.requirements;
  const off = whyNoPicture(store);
  // The elements are those of the plan as it was made.
  const parts = isAsPlanned ? (plan.why?.stations.find((one) => one.station === station.id)?.own_parts ?? []) : [];
  return (
    <div class="own">
      {parts.length > 0 && (
        <ul class="muted">
          {parts.slice(0, 3).map((part) => (
            <li key={`${part.name} ${part.room?.name}`}>
              <span title={part.name}>
                {[part.name || t('Unnamed element'), part.room?.name].filter(Boolean).join(' · ')}
              </span>
              <span>{areaWords(part.area_m2)}</span>
            </li>
          ))}
        </ul>
      )}
      <Losses store={store} losses={worth?.losses ?? []} results={results ?? plan.requirements.results} />
      <label class="check" title={off ?? undefined}>
        <input
          type="checkbox"
          disabled={off !== null}
          checked={store.showsOwn.value}
          onChange={(event) => showOwn(store, event.currentTarget.checked, null)}
        />
        {lossWords(plan).highlight}
      </label>
    </div>
  );
}

interface LossesProps {
  readonly store: Store;
  readonly losses: readonly StationLoss[];
  /** Of the plan with the station. */
  readonly results: readonly Readonly<RequirementResult>[];
}

/** What each requirement would lose without the station, and whether it would still be met; a click highlights it. */
function Losses({ store, losses, results }: LossesProps) {
  if (losses.length === 0) return null;
  const off = whyNoPicture(store);
  return (
    <>
      <h3>{t('If removed')}</h3>
      <ul class="losses" aria-label={t('Losses by requirement if removed')}>
        {losses.map((loss) => {
          const now = results.find(({ name }) => name === loss.requirement);
          const isShown = store.showsOwn.value && store.ownRequirement.value === loss.requirement;
          return (
            <li key={loss.requirement}>
              <button
                type="button"
                class={loss.met ? 'loss' : 'loss loss-broken'}
                aria-pressed={isShown}
                disabled={off !== null}
                title={off ?? t('Highlight what this requirement would lose')}
                onClick={() => showOwn(store, !isShown, isShown ? null : loss.requirement)}
              >
                <span>{requirementName(loss.requirement)}</span>
                <span>−{areaWords(loss.area_m2)}</span>
                {now !== undefined && <small>{verdictOf(loss, now)}</small>}
              </button>
            </li>
          );
        })}
      </ul>
    </>
  );
}

function showOwn(store: Store, isShown: boolean, requirement: string | null): void {
  batch(() => {
    store.showsOwn.value = isShown;
    store.ownRequirement.value = requirement;
  });
}

function Links({ store, plan, station }: StationProps) {
  const counting = countingOf(plan);
  const own = store.shownLinks.value
    .filter((link) => link.a === station.id || link.b === station.id)
    .sort((a, b) => b.overlap - a.overlap);
  const strong = own.filter((link) => lackInWords(link, counting) === null);
  const otherEnd = (link: PlanLink): string => (link.a === station.id ? link.b : link.a);
  return (
    <div class="links">
      <h3>
        {t('{links} of at least {needs}', {
          links: counted(strong.length, 'link'),
          needs: needsWords(plan, overlapNoun(plan.requirements)),
        })}
      </h3>
      <ul class="chips">
        {own.slice(0, MOST_LINKS).map((link) => (
          <li key={otherEnd(link)}>
            <button
              type="button"
              class={strong.includes(link) ? 'chip chip-strong' : 'chip'}
              title={lackInWords(link, counting) ?? t('Enough to register: highlight the shared surface')}
              onClick={() => store.choosePair([station.id, otherEnd(link)])}
            >
              {otherEnd(link)} <span>{linkPercent(link, counting)}</span>
            </button>
          </li>
        ))}
      </ul>
    </div>
  );
}
