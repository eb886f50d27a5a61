/** What the arrows, plus signs and crosses of a comparison mean, and how many stations each is. */

import type { VNode } from 'preact';
import { ARROW_COLOURS } from '../edit/arrows.ts';
import { t } from '../language/language.ts';
import { counted } from '../panels/figures.ts';
import type { Store } from '../store.ts';
import type { StationChange } from './difference.ts';
import { changesShown } from './station-changes.ts';

const WORDS: Readonly<Record<StationChange['kind'], string>> = {
  moved: t('moved'),
  new: t('only in this plan'),
  gone: t('only in the other plan'),
};

export function ChangesLegend({ store }: { store: Store }) {
  const changes = changesShown(store);
  const kinds = (['moved', 'new', 'gone'] as const).filter((one) => changes.some(({ kind }) => kind === one));
  if (kinds.length === 0) return null;
  return (
    <ul class="legend-classes" aria-label={t('Stations that differ')}>
      {kinds.map((kind) => (
        <li key={kind}>
          <ChangeSign kind={kind} />
          {counted(changes.filter((change) => change.kind === kind).length, 'station')} {WORDS[kind]}
        </li>
      ))}
    </ul>
  );
}

const STROKES: Readonly<Record<StationChange['kind'], string>> = {
  moved: 'M1 7H8M8 3L13 7L8 11Z',
  new: 'M7 1V13M1 7H13',
  gone: 'M2 2L12 12M2 12L12 2',
};

function ChangeSign({ kind }: { kind: StationChange['kind'] }): VNode {
  const color = ARROW_COLOURS[kind];
  return (
    <svg class="swatch" viewBox="0 0 14 14" aria-hidden="true">
      <path d={STROKES[kind]} stroke={color} fill={color} stroke-width="2.5" />
    </svg>
  );
}
