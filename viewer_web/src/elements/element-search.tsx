/** Search for elements of the building; a click flies to one and opens its card. */

import { useState } from 'preact/hooks';
import { t } from '../language/language.ts';
import { kindInWords } from '../panels/figures.ts';
import { Section } from '../panels/section.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { foundElements } from './search.ts';

/** More rows are no answer: another word is. */
const MOST = 12;

export function ElementSearch({ store, view }: { store: Store; view: PlanView | null }) {
  const [typed, type] = useState('');
  const elements = store.loaded.value?.stage.elements ?? [];
  const found = foundElements(elements, typed);
  return (
    <Section
      title={t('Elements')}
      aside={typed.trim() === '' ? String(elements.length) : t('{n} found', { n: found.length })}
    >
      <input
        type="search"
        class="element-search"
        aria-label={t('Search elements')}
        placeholder={t('Name, class or GlobalId')}
        value={typed}
        onInput={(event) => type(event.currentTarget.value)}
      />
      <ul class="rows" aria-label={t('Elements found')}>
        {found.slice(0, MOST).map((index) => {
          const { name, kind, floorId } = elements[index];
          const floor = store.loaded.value?.plan.floors.find(({ id }) => id === floorId)?.name;
          const isChosen = store.picked.value?.elementIndex === index;
          return (
            <li key={index}>
              <button
                type="button"
                class={isChosen ? 'row row-chosen' : 'row'}
                aria-pressed={isChosen}
                disabled={view === null}
                onClick={() => view?.showElement(index)}
              >
                <span class="row-main">
                  <span class="row-name">{name || t('Unnamed element')}</span>
                  <span class="muted row-place">{[kindInWords(kind), floor].filter(Boolean).join(' · ')}</span>
                </span>
              </button>
            </li>
          );
        })}
      </ul>
      {found.length > MOST && <p class="muted">{t('{n} more: type another word.', { n: found.length - MOST })}</p>}
    </Section>
  );
}
