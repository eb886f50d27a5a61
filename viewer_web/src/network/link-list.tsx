/** The list of links: each with its overlap, how firmly it holds, and the motion that it holds least. */

import { useState } from 'preact/hooks';
import { decimal, t } from '../language/language.ts';
import type { PlanLink } from '../load/plan-json.ts';
import { Section } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { type Counting, linkPercent, type NetworkReport } from './graph.ts';
import { type LinkGroup, lackInWords, linkGroups, targetsWords } from './link-groups.ts';
import { strengthColor } from './strength.ts';
import { northHint, weakMotionOf } from './weak-motion.ts';
import './network.css';

const LINKS_A_PAGE = 40;

interface LinkListProps {
  readonly store: Store;
  readonly report: NetworkReport;
  readonly counting: Counting;
}

export function LinkList({ store, report, counting }: LinkListProps) {
  return (
    <>
      <p class="muted north">{northHint(store.loaded.value?.plan.scene.georeference?.to_map ?? null)}</p>
      {linkGroups(store.shownLinks.value, report, counting).map((group) => (
        <Group key={group.title} group={group} store={store} report={report} counting={counting} />
      ))}
    </>
  );
}

function Group({ group, store, report, counting }: LinkListProps & { group: LinkGroup }) {
  const { title, aside, links } = group;
  const [nRows, setRows] = useState(group.nShown);
  return (
    <Section title={title} aside={`${links.length} · ${aside}`}>
      <ul class="rows" aria-label={title}>
        {links.slice(0, nRows).map((link) => (
          <LinkRow
            key={`${link.a} ${link.b}`}
            store={store}
            link={link}
            isWeakest={link === report.weakest}
            counting={counting}
          />
        ))}
      </ul>
      {links.length > nRows && (
        <button type="button" class="more" onClick={() => setRows(nRows + LINKS_A_PAGE)}>
          {t('Show more')}
        </button>
      )}
    </Section>
  );
}

interface LinkRowProps {
  readonly store: Store;
  readonly link: PlanLink;
  readonly isWeakest: boolean;
  readonly counting: Counting;
}

function LinkRow({ store, link, isWeakest, counting }: LinkRowProps) {
  const lack = lackInWords(link, counting);
  const { pair } = store;
  const isChosen = pair.value?.includes(link.a) === true && pair.value.includes(link.b);
  const weak = weakMotionOf(link.weak_motion);
  const byTargets = targetsWords(link) !== null;
  const words = byTargets
    ? t('registers by targets alone')
    : (lack ?? (weak === null ? null : t('weakest direction: {direction}', { direction: weak.short })));
  return (
    <li>
      <button
        type="button"
        class={isChosen ? 'row row-link row-chosen' : 'row row-link'}
        aria-pressed={isChosen}
        title={
          weak === null
            ? undefined
            : t('Weakest direction: {direction}. {why}', { direction: weak.long, why: weak.why }).trimEnd()
        }
        onClick={() => store.choosePair(isChosen ? null : [link.a, link.b])}
      >
        <svg class="link-line" viewBox="0 0 18 6" aria-hidden="true">
          <line x1="1" y1="3" x2="17" y2="3" stroke={strengthColor(link.strength, store.isDark.value)} />
        </svg>
        <span class="row-main">
          <span class="row-name">
            {link.a} – {link.b}
            {isWeakest && <span class="link-tag">{t('weakest')}</span>}
          </span>
          {words !== null && <span class="muted link-words">{words}</span>}
        </span>
        <span class="row-area">
          {link.strength !== null && lack === null && !byTargets && <b>{decimal(link.strength, 3)}</b>}{' '}
          {!byTargets && linkPercent(link, counting)}
        </span>
      </button>
    </li>
  );
}
