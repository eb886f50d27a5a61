/** What is required of the plan, part by part, and whether it is met: as planned, and as edited where it was. */

import { isAllMet, type Met, missedOf, OVERALL, type Totals } from '../edit/totals.ts';
import type { TotalsBeside } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import { areaWords, askedPercent, counted, reachedPercent } from './figures.ts';
import './requirements.css';

export function Requirements({ planned, isEdited, edited, isStale }: TotalsBeside) {
  const columns: (readonly [string, Totals | null])[] = [[t('as planned'), planned]];
  if (isEdited) columns.push([t('as edited'), edited]);
  return (
    <table class={className(isEdited, isStale)} data-testid="requirements">
      {isEdited && (
        <thead>
          <tr>
            <td />
            {columns.map(([title]) => (
              <th key={title} scope="col">
                {title}
              </th>
            ))}
          </tr>
        </thead>
      )}
      <tbody>
        {planned.requirements.map(({ name, required, asSetUp }) => (
          <tr key={name}>
            <th scope="row">
              {name === OVERALL ? t('Whole building') : name}
              <small>
                {t('{required} required', { required: askedPercent(required) })}
                {asSetUp !== undefined &&
                  `, ${t('{percent} or more as set up', { percent: reachedPercent(asSetUp, required) })}`}
                {name === OVERALL && withoutWords(planned)}
              </small>
            </th>
            {columns.map(([title, totals]) => (
              <td key={title}>
                <Verdict
                  met={totals?.requirements.find((each) => each.name === name)}
                  isPartial={name === OVERALL && planned.unreachableM2 > 0}
                />
              </td>
            ))}
          </tr>
        ))}
        {planned.isNetworkRequired && (
          <tr>
            <th scope="row">
              {t('Network')}
              <small>{planned.isRedundancyRequired ? t('redundant network required') : t('one group required')}</small>
            </th>
            {columns.map(([title, totals]) => (
              <td key={title}>
                {totals === null ? <span class="muted">{t('unknown')}</span> : <Network {...totals} />}
              </td>
            ))}
          </tr>
        )}
        {isEdited && <CountRow name={t('Stations')} columns={columns} of={({ nStations }) => String(nStations)} />}
        {isEdited && !planned.isNetworkRequired && (
          <CountRow name={t('Connected groups')} columns={columns} of={({ nNetworks }) => String(nNetworks)} />
        )}
      </tbody>
    </table>
  );
}

function className(isEdited: boolean, isStale: boolean): string {
  return [
    'requirements',
    ...(isEdited ? ['requirements-beside'] : []),
    ...(isStale ? ['requirements-stale'] : []),
  ].join(' ');
}

interface CountRowProps {
  readonly name: string;
  readonly columns: readonly (readonly [string, Totals | null])[];
  readonly of: (totals: Totals) => string;
}

function CountRow({ name, columns, of }: CountRowProps) {
  return (
    <tr>
      <th scope="row">{name}</th>
      {columns.map(([title, totals]) => (
        <td key={title}>{totals === null ? t('unknown') : of(totals)}</td>
      ))}
    </tr>
  );
}

/** `met` undefined: what the edited plan is worth is not known. */
function Verdict({ met, isPartial }: { met: Met | undefined; isPartial: boolean }) {
  if (met === undefined) return <span class="muted">{t('unknown')}</span>;
  return (
    <>
      {reachedPercent(met.coverage, met.required)} <MetWord isMet={met.isMet} isPartial={isPartial} />
    </>
  );
}

function Network({ nNetworks, lacksNetwork }: Totals) {
  return (
    <>
      {t('{n, plural, one {# group} other {# groups}}', { n: nNetworks })}{' '}
      <MetWord isMet={!lacksNetwork} isPartial={false} />
    </>
  );
}

/** What the share of all leaves out. */
const withoutWords = ({ unreachableM2 }: Totals): string =>
  unreachableM2 > 0
    ? `, ${t('without {area} of floor that can’t be reached', { area: areaWords(unreachableM2) })}`
    : '';

/** In words, so that nobody has to know the colours. `isPartial`: of what can be reached, and not all can: no green. */
export function MetWord({ isMet, isPartial }: { isMet: boolean; isPartial: boolean }) {
  const look = isMet ? (isPartial ? 'badge-part' : 'badge-good') : 'badge-warn';
  return <span class={`badge ${look}`}>{isMet ? t('MET') : t('NOT MET')}</span>;
}

/** "Ground floor 93.1 % of 95 %"; empty where all is met. */
export function missedInWords(requirements: readonly Met[]): string {
  return missedOf(requirements)
    .map(({ name, coverage, required }) =>
      t('{part} {coverage} of {required}', {
        part: wordOf(name),
        coverage: reachedPercent(coverage, required),
        required: askedPercent(required),
      }),
    )
    .join(', ');
}

const wordOf = (name: string): string => (name === OVERALL ? t('whole building') : name);

const networkInWords = (nNetworks: number): string =>
  nNetworks > 1 ? t('network in {n} groups', { n: nNetworks }) : t('network held together by single links');

/** "2 of 3 not met"; for hints. */
export function metInWords(totals: Totals): string {
  const { requirements, isNetworkRequired, lacksNetwork, nNetworks } = totals;
  if (isAllMet(totals)) {
    const n = requirements.length + Number(isNetworkRequired);
    return t('{requirements} met', { requirements: counted(n, 'requirement') });
  }
  const network = lacksNetwork ? networkInWords(nNetworks) : '';
  const missed = [missedInWords(requirements), network].filter(Boolean).join(', ');
  return t('Not met: {requirements}', { requirements: missed });
}
