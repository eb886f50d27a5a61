/** The figures of a pair of stations: what they share, and how firmly that holds their scans together. */
import { t } from '../language/language.ts';
import { Card } from '../panels/card.tsx';
import { areaWords, overlapDefined, probabilityPercent, reachedPercent } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { countingOf, networkOf, startWords } from './graph.ts';
import { doorsWords, lackInWords, targetsWords } from './link-groups.ts';
import { strengthInWords } from './strength.ts';
import { northHint, weakMotionOf } from './weak-motion.ts';
import './network.css';

export function PairCard({ store }: { store: Store }) {
  const pair = store.pair.value;
  const plan = store.loaded.value?.plan;
  if (pair === null || plan === undefined) return null;
  const link = store.shownLinks.value.find(({ a, b }) => pair.includes(a) && pair.includes(b));
  const counting = countingOf(plan);
  const ids = store.shownStations.value.map(({ id }) => id);
  const { bridges } = networkOf(ids, store.shownLinks.value, counting);
  const marking = store.marking.value;
  const weak = weakMotionOf(link?.weak_motion ?? null);
  const doors = link === undefined ? null : doorsWords(link);
  const targets = link === undefined ? null : targetsWords(link);
  const north = northHint(plan.scene.georeference?.to_map ?? null);
  const verdict = (): string => {
    if (link === undefined) return t('no link');
    const lack = lackInWords(link, counting);
    if (lack !== null) return t('does not register: {lack}', { lack });
    if (targets !== null) return t('registers by targets alone');
    return bridges.has(link) ? t('single-link connection: the network splits without it') : t('registers');
  };
  return (
    <Card
      title={`${pair[0]} – ${pair[1]}`}
      subtitle={verdict()}
      name={t('Chosen pair')}
      onClose={() => store.choosePair(null)}
    >
      <dl class="figures" data-testid="pair-figures">
        <Figure
          name={t('Overlap')}
          value={link === undefined ? '–' : reachedPercent(link.overlap, counting.threshold)}
          hint={overlapDefined(plan.requirements)}
        />
        {link?.probability != null && (
          <Figure
            name={t('Probability')}
            value={probabilityPercent(link.probability, counting.minProbability)}
            hint={t('That the two scans register: {start}', { start: startWords(plan) })}
          />
        )}
        {marking.kind === 'shown' && (
          <Figure
            name={t('Shared surface')}
            value={areaWords(marking.areaM2)}
            hint={t('Highlighted in the building')}
          />
        )}
        <Figure
          name={t('Strength')}
          value={link === undefined ? '–' : strengthInWords(link.strength)}
          hint={t('How firmly the shared surface ties the two scans: 0 not at all, 1 like a closed box')}
        />
        {weak !== null && <Figure name={t('Weakest direction')} value={weak.long} hint={north} />}
        {targets !== null && (
          <Figure
            name={t('Targets')}
            value={targets}
            hint={t('Where both stations see them, in the coordinates of the model')}
          />
        )}
        {doors !== null && (
          <Figure name={t('Doors')} value={doors} hint={t('That this takes while both stations are scanned')} />
        )}
      </dl>
      {weak !== null && <p class="muted weak-why">{`${weak.why} ${north}`}</p>}
      <ul class="chips">
        {pair.map((id) => (
          <li key={id}>
            <button type="button" class="chip chip-strong" onClick={() => store.chooseStation(id)}>
              {t('Station {id}', { id })}
            </button>
          </li>
        ))}
      </ul>
    </Card>
  );
}
