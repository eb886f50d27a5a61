/** One line above all tabs: whether all that is required is met, and by what it is missed. */

import { isAllMet, type Met, OVERALL, type Totals } from '../edit/totals.ts';
import { totalsNow } from '../edit/totals-beside.ts';
import { t } from '../language/language.ts';
import type { Store } from '../store.ts';
import { reachedPercent } from './figures.ts';
import { MetWord, metInWords } from './requirements.tsx';

export function VerdictLine({ store }: { store: Store }) {
  if (store.loaded.value === null) return null;
  const totals = totalsNow(store);
  if (totals === null)
    return (
      <p class="verdict" data-testid="verdict">
        <span class="badge badge-part">{t('unknown as edited')}</span>
      </p>
    );
  return (
    <p class="verdict" data-testid="verdict" title={metInWords(totals)}>
      <MetWord isMet={isAllMet(totals)} isPartial={totals.unreachableM2 > 0} />
      {partsOf(totals).map(({ words, isMet }) => (
        <span key={words} class={isMet ? 'verdict-part' : 'verdict-part verdict-missed'}>
          <span aria-hidden="true">{isMet ? '✓' : '!'}</span> {words}
        </span>
      ))}
    </p>
  );
}

interface Part {
  readonly words: string;
  readonly isMet: boolean;
}

/** Coverage, floors, zones and classes, network: each in two words, and only what something is required of. */
export function partsOf(totals: Totals): readonly Part[] {
  const { requirements, floors, coverage, required, isNetworkRequired, lacksNetwork, nNetworks } = totals;
  const overall = requirements.find(({ name }) => name === OVERALL);
  const ofFloors = floors.map((floor) => ({ isMet: floor.coverage >= floor.required - ROUNDING }));
  const names = new Set(floors.flatMap(({ id, name }) => [id, name]));
  const others = requirements.filter(({ name }) => name !== OVERALL && !names.has(name));
  const count = (all: readonly Pick<Met, 'isMet'>[]) => ({
    met: all.filter(({ isMet }) => isMet).length,
    all: all.length,
  });
  const parts: Part[] = [{ words: reachedPercent(coverage, required), isMet: overall?.isMet ?? true }];
  const add = (words: string, { met, all }: { readonly met: number; readonly all: number }): void => {
    if (all > 0) parts.push({ words, isMet: met === all });
  };
  if (floors.length > 1) add(t('{met} of {all} floors', count(ofFloors)), count(ofFloors));
  add(t('{met} of {all} zones and classes', count(others)), count(others));
  if (isNetworkRequired)
    parts.push({
      words: nNetworks === 1 ? t('connected') : t('{n, plural, one {# group} other {# groups}}', { n: nNetworks }),
      isMet: !lacksNetwork,
    });
  return parts;
}

/** As `Coverage.meets` of the library. */
const ROUNDING = 1e-9;
