/** The groups that do not register with each other: members, why they are apart, and a station that would join them. */

import { isLive, whyNoEditing, whyNotLive } from '../edit/readiness.ts';
import { dropGhost, searchJoin } from '../ghost/ghosts.ts';
import { Swatch } from '../heat/legend.tsx';
import { t } from '../language/language.ts';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { counted } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import type { Counting, NetworkReport } from './graph.ts';
import { type Group, groupColor, groupsOf, whyApart } from './groups.ts';

interface GroupListProps {
  readonly store: Store;
  readonly loaded: LoadedPlan;
  readonly report: NetworkReport;
  readonly counting: Counting;
}

export function GroupList({ store, loaded, report, counting }: GroupListProps) {
  const groups = groupsOf(report);
  if (groups.length < 2) return null;
  return (
    <Section title={t('Groups')} aside={t('{n} that do not register with each other', { n: groups.length })}>
      <ul class="rows" aria-label={t('Groups')}>
        {groups.map((group) => (
          <Row key={group.number} store={store} group={group} counting={counting} />
        ))}
      </ul>
      <Join store={store} loaded={loaded} />
    </Section>
  );
}

function Row({ store, group, counting }: { store: Store; group: Group; counting: Counting }) {
  const { number, stations, nearest } = group;
  return (
    <li>
      <button
        type="button"
        class="row group-row"
        data-group={number}
        disabled={nearest === null}
        onClick={() => nearest !== null && store.choosePair([nearest.a, nearest.b])}
      >
        <Swatch color={groupColor(number)} />
        <span class="row-main">
          <span class="row-name">
            {t('Group {n}', { n: number })} · {counted(stations.length, 'station')}
          </span>
          <span class="group-about">{stations.join(' ')}</span>
          <span class="muted group-about">{whyApart(group, counting)}</span>
        </span>
      </button>
    </li>
  );
}

function Join({ store, loaded }: { store: Store; loaded: LoadedPlan }) {
  const search = store.joinSearch.value;
  const why = store.reviewClient === null ? whyNoEditing(store) : whyNotLive(store);
  return (
    <div class="group-join">
      {search.kind === 'searching' ? (
        <>
          <p class="muted" role="status">
            {search.of === 0
              ? t('Preparing positions between the groups …')
              : t('Trying position {n} of {of} …', { n: search.nTried + 1, of: search.of })}
          </p>
          <button type="button" class="button button-small" onClick={() => dropGhost(store)}>
            {t('Stop')}
          </button>
        </>
      ) : (
        <button
          type="button"
          class="button button-small"
          disabled={!isLive(store)}
          title={why ?? t('Find the position that joins most groups')}
          onClick={() => void searchJoin(store, loaded)}
        >
          {t('Join groups')}
        </button>
      )}
      {why !== null && <p class="muted">{why}</p>}
      {search.kind === 'nothing' && (
        <p class="note" role="status">
          {t(
            'None of the {n} positions tried joins two groups by itself: open doors, or plan again with more stations.',
            { n: search.nTried },
          )}
        </p>
      )}
      {search.kind === 'failed' && <p class="note note-warn">{search.message}</p>}
    </div>
  );
}
