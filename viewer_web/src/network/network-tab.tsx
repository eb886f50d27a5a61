/** The tab "Network": how the stations register with each other, what holds them together, and what is missing. */

import { useState } from 'preact/hooks';
import { hasEdits, stationsOf } from '../edit/review-stations.ts';
import { plain, t } from '../language/language.ts';
import type { NetworkJoin, PlanLink } from '../load/plan-json.ts';
import { overlapNoun } from '../panels/figures.ts';
import { Figure, Section } from '../panels/section.tsx';
import { Badge } from '../panels/summary.tsx';
import type { Store } from '../store.ts';
import { type Counting, countingOf, linkPercent, type NetworkReport, needsWords, networkOf } from './graph.ts';
import { Graph } from './graph-view.tsx';
import { GroupList } from './group-list.tsx';
import { joinsInWords } from './groups.ts';
import { LinkList } from './link-list.tsx';
import { Matrix } from './matrix.tsx';
import { strengthInWords } from './strength.ts';
import { OverlapLegend, StrengthLegend } from './strength-legend.tsx';

type Picture = 'graph' | 'matrix';

/** Width of the sidebar's pages. */
const WIDTH = 308;

export function NetworkTab({ store }: { store: Store }) {
  const [picture, setPicture] = useState<Picture>('graph');
  const loaded = store.loaded.value;
  if (loaded === null) return null;
  const { plan } = loaded;
  const counting = countingOf(plan);
  const ids = store.shownStations.value.map(({ id }) => id);
  const report = networkOf(ids, store.shownLinks.value, counting);
  return (
    <>
      <Section title={t('Registration')}>
        <Figures
          report={report}
          counting={counting}
          needs={needsWords(plan, overlapNoun(plan.requirements))}
          joins={hasEdits(stationsOf(store)) ? [] : (plan.registration.joins ?? [])}
          store={store}
        />
      </Section>
      <GroupList store={store} loaded={loaded} report={report} counting={counting} />
      <Section title={picture === 'graph' ? t('Links between stations') : t('Overlap by pair')}>
        <div class="segments segments-flat" role="radiogroup" aria-label={t('Picture of the network')}>
          {(['graph', 'matrix'] as const).map((one) => (
            // biome-ignore lint/a11y/useSemanticElements: drawn as one segment of a bar.
            <button key={one} type="button" role="radio" aria-checked={picture === one} onClick={() => setPicture(one)}>
              {one === 'graph' ? t('Graph') : t('Matrix')}
            </button>
          ))}
          <button
            type="button"
            class="segment-end"
            onClick={() => {
              store.sheet.value = picture;
            }}
          >
            {t('Enlarge')}
          </button>
        </div>
        {picture === 'graph' ? (
          <>
            <Graph store={store} report={report} width={WIDTH} />
            <GraphKey />
          </>
        ) : (
          <>
            <Matrix store={store} counting={counting} width={WIDTH} />
            <OverlapLegend isDark={store.isDark.value} threshold={counting.threshold} />
          </>
        )}
        <StrengthLegend isDark={store.isDark.value} />
      </Section>
      <LinkList store={store} report={report} counting={counting} />
    </>
  );
}

/** What it was ranked by. */
const weakestWords = (link: PlanLink, counting: Counting): string =>
  counting.minProbability > 0 && link.probability !== null
    ? t('probability {percent}', { percent: linkPercent(link, counting) })
    : link.strength === null
      ? t('overlap {percent}', { percent: linkPercent(link, counting) })
      : t('strength {strength}', { strength: strengthInWords(link.strength) });

/** What the marks of the graph mean; colours: the legend below. */
export function GraphKey() {
  return (
    <p class="muted graph-key">
      <span>
        <svg viewBox="0 0 16 16" aria-hidden="true">
          <circle class="graph-ring" cx="8" cy="8" r="6" />
        </svg>
        {t('critical station')}
      </span>
      <span>
        <svg viewBox="0 0 16 16" aria-hidden="true">
          <line class="graph-bridge-case" x1="2" y1="8" x2="14" y2="8" />
        </svg>
        {t('single-link connection')}
      </span>
      <span>
        <svg viewBox="0 0 16 16" aria-hidden="true">
          <line class="graph-missing" x1="0" y1="8" x2="16" y2="8" />
        </svg>
        {t('missing link')}
      </span>
    </p>
  );
}

interface FiguresProps {
  store: Store;
  report: NetworkReport;
  counting: Counting;
  /** What links need. */
  needs: string;
  /** Of the plan as it was made: what stations are worth is another matter once some are edited. */
  joins: readonly NetworkJoin[];
}

function Figures({ store, report, counting, needs, joins }: FiguresProps) {
  const { components, bridges, articulations, weakest } = report;
  return (
    <dl class="figures" data-testid="network-figures">
      <Figure
        name={t('Network')}
        value={
          <Badge isGood={components.length <= 1}>
            {components.length <= 1 ? t('connected') : t('{n} unconnected groups', { n: components.length })}
          </Badge>
        }
        hint={components.map((component) => component.join(' ')).join('\n')}
      />
      <Figure
        name={t('Registration links')}
        value={report.counting.length}
        hint={
          counting.minStrength > 0
            ? t('At least {needs} and strength {strength}', {
                needs,
                strength: plain(counting.minStrength),
              })
            : t('At least {needs}', { needs })
        }
      />
      <Figure
        name={t('Single-link connections')}
        value={bridges.size}
        hint={t('Links without which the network splits')}
      />
      <Figure
        name={t('Critical stations')}
        value={articulations.size}
        hint={t('Without one of them the network splits: {stations}', {
          stations: [...articulations].join(' ') || t('none'),
        })}
      />
      {joins.length > 0 && (
        <Figure
          name={t('Only for the network')}
          hint={`${t('Stations that no required surface needs')}\n${joinsInWords(joins)}`}
          value={joins
            .flatMap(({ stations }) => stations)
            .map((id) => (
              <button key={id} type="button" class="link" onClick={() => store.chooseStation(id)}>
                {id}
              </button>
            ))}
        />
      )}
      {weakest !== null && (
        <Figure
          name={t('Weakest link')}
          hint={t('The nearest to what is required, on the best connection between any two stations')}
          value={
            <button type="button" class="link" onClick={() => store.choosePair([weakest.a, weakest.b])}>
              {weakest.a} – {weakest.b}, {weakestWords(weakest, counting)}
            </button>
          }
        />
      )}
    </dl>
  );
}
