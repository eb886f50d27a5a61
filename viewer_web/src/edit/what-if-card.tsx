/** The card of a station on its way: what it sees, adds and loses there, and which links come and go. */

import { t } from '../language/language.ts';
import { countingOf } from '../network/graph.ts';
import { areaWords } from '../panels/figures.ts';
import { Figure } from '../panels/section.tsx';
import type { Store } from '../store.ts';
import { linkChange } from './what-if.ts';

export function WhatIfCard({ store }: { store: Store }) {
  const { editing, loaded, reviewClient } = store;
  const [moving, head, surface] = [editing.underWay.value, editing.preview.value, editing.surfaceChange.value];
  const plan = loaded.value?.plan;
  if (moving === null || plan === undefined) return null;
  const before = reviewClient?.figures.value?.registration.links ?? plan.registration.links;
  const links = head && linkChange(moving.stationId, before, head.links, countingOf(plan));
  const list = (ids: readonly string[]) => ids.join(' ') || t('none');
  return (
    <aside class="card what-if" aria-label={t('What if')} data-testid="what-if">
      <h2>{moving.stationId === null ? t('A new station here') : t('{id} here', { id: moving.stationId })}</h2>
      {head === null || links === null ? (
        <p class="muted">{t('Computing …')}</p>
      ) : !head.admissible ? (
        <p class="note note-warn">{t('No valid tripod position there: {reason}.', { reason: head.reason })}</p>
      ) : (
        <dl class="figures">
          <Figure name={t('Sees')} value={areaWords(head.station.covered_area_m2)} />
          {surface !== null && (
            <>
              <Figure name={t('Adds')} value={<span class="what-if-won">{`+${areaWords(surface.wonM2)}`}</span>} />
              <Figure name={t('Loses')} value={<span class="what-if-lost">{`−${areaWords(surface.lostM2)}`}</span>} />
            </>
          )}
          <Figure name={t('Links won')} value={list(links.won)} />
          <Figure name={t('Links lost')} value={list(links.lost)} />
        </dl>
      )}
    </aside>
  );
}
