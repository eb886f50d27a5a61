/** What the plan is worth as a whole. */

import { countingLinks } from '../edit/totals.ts';
import { type TotalsBeside, totalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import { countingOf, needsWords } from '../network/graph.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { ShortfallList } from '../shortfalls/shortfall-list.tsx';
import type { Store } from '../store.ts';
import { areaWords, counted, optimalityInWords, overlapNoun, percent, reachedPercent } from './figures.ts';
import { Requirements } from './requirements.tsx';
import { Figure, Section } from './section.tsx';

interface SummaryProps {
  readonly store: Store;
  /** Null until the building is drawn. */
  readonly view: PlanView | null;
}

export function Summary({ store, view }: SummaryProps) {
  const [loaded, totals] = [store.loaded.value, totalsBeside(store)];
  if (loaded === null || totals === null) return null;
  const { plan } = loaded;
  const { coverage, optimality, registration, requirements, scanner, warnings } = plan;
  const nLinks = countingLinks(registration.links, countingOf(plan));
  return (
    <Section title={t('Plan')}>
      <Headline {...totals} required={requirements.coverage} />
      <ShortfallList store={store} loaded={loaded} totals={totals.edited ?? totals.planned} view={view} />
      <Meter fraction={(totals.edited ?? totals.planned).coverage} required={requirements.coverage} />
      <Requirements {...totals} />
      {totals.isEdited && <h3>{t('As planned')}</h3>}
      <dl class="figures">
        <Figure
          name={t('Seen area')}
          value={`${areaWords(coverage.covered_area_m2)}`}
          hint={t('Area that at least one station sees')}
        />
        <Figure
          name={t('Scannable area')}
          value={areaWords(coverage.achievable_area_m2)}
          hint={t('Area that at least one candidate position sees')}
        />
        <Figure
          name={t('Coverage of all surface')}
          value={percent(coverage.fraction_of_total)}
          hint={t('Seen share of the {area} of the model, insides of walls included', {
            area: areaWords(coverage.total_area_m2),
          })}
        />
        <Figure
          name={t('Lower bound')}
          value={optimality.lower_bound === null ? t('unknown') : counted(optimality.lower_bound, 'station')}
          hint={t('On these candidates no plan with fewer stations meets the requirements')}
        />
        <Figure
          name={t('Optimality')}
          value={optimalityInWords(optimality)}
          hint={t('Stations of the plan against the lower bound')}
        />
        <Figure
          name={t('Registration')}
          value={
            <Badge isGood={registration.connected}>
              {registration.connected ? t('connected') : t('not connected')}
            </Badge>
          }
          hint={t('{links} of at least {needs}', {
            links: counted(nLinks, 'link'),
            needs: needsWords(plan, overlapNoun(requirements)),
          })}
        />
        <Figure name={t('Scanner')} value={scanner.title} />
      </dl>
      {warnings.length > 0 && (
        <details class="warnings">
          <summary>{counted(warnings.length, 'warning')}</summary>
          <ul>
            {warnings.map((warning) => (
              <li key={warning}>{warning}</li>
            ))}
          </ul>
        </details>
      )}
    </Section>
  );
}

/** Of the plan, or of what became of it: both stand in the table below. */
function Headline({ planned, isEdited, edited, isStale, required }: TotalsBeside & { readonly required: number }) {
  const { coverage, nStations } = edited ?? planned;
  const as = edited !== null ? `, ${t('as edited')}` : isEdited ? `, ${t('as planned')}` : '';
  return (
    <div class={isStale ? 'headline requirements-stale' : 'headline'}>
      <div>
        <strong data-testid="coverage">{reachedPercent(coverage, required)}</strong>
        <span>
          {t('coverage of scannable area')}
          {as}
        </span>
      </div>
      <div>
        <strong data-testid="station-count">{nStations}</strong>
        <span>
          {nStations === 1 ? t('station') : t('stations')}
          {as}
        </span>
      </div>
    </div>
  );
}

export function Badge({ isGood, children }: { isGood: boolean; children: string }) {
  return (
    <span class={isGood ? 'badge badge-good' : 'badge badge-warn'}>
      <span aria-hidden="true">{isGood ? '✓' : '!'}</span> {children}
    </span>
  );
}

/** A bar of coverage; the tick is what is required. */
export function Meter({ fraction, required }: { fraction: number; required?: number }) {
  const width = Math.min(100, Math.max(0, 100 * fraction));
  return (
    <svg class="meter" viewBox="0 0 100 4" preserveAspectRatio="none" aria-hidden="true">
      <rect class="meter-back" width="100" height="4" />
      <rect class="meter-front" width={width} height="4" />
      {required !== undefined && <rect class="meter-tick" x={100 * required - 0.35} width="0.7" height="4" />}
    </svg>
  );
}
