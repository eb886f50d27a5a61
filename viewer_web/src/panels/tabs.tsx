/** The tabs of the sidebar: which of its pages is shown. */

import type { ComponentChildren } from 'preact';
import { EditTab } from '../edit/edit-tab.tsx';
import { ElementSearch } from '../elements/element-search.tsx';
import { FileList } from '../files/file-list.tsx';
import { FloorSelector } from '../floors/floor-selector.tsx';
import { t } from '../language/language.ts';
import { NetworkTab } from '../network/network-tab.tsx';
import { ReviewTab } from '../review/review-tab.tsx';
import { RoomList } from '../rooms/room-list.tsx';
import { RouteSection } from '../route/route-section.tsx';
import { RunsTab } from '../runs/runs-tab.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import { StationList } from '../stations/station-list.tsx';
import type { Store } from '../store.ts';
import { UnseenTab } from '../unseen/unseen-tab.tsx';
import { KeysHelp } from './keys-help.tsx';
import type { TabId } from './state.ts';
import { Summary } from './summary.tsx';
import { VerdictLine } from './verdict-line.tsx';

interface Tab {
  readonly id: TabId;
  readonly title: string;
  /** Changes something, so not there where the page only shows files. */
  readonly needsServer: boolean;
}

export const TABS: readonly Tab[] = [
  { id: 'plan', title: t('Plan'), needsServer: false },
  { id: 'unseen', title: t('Unseen'), needsServer: false },
  { id: 'network', title: t('Network'), needsServer: false },
  { id: 'edit', title: t('Edit'), needsServer: true },
  { id: 'runs', title: t('Runs'), needsServer: true },
  { id: 'review', title: t('Review'), needsServer: false },
];

interface TabsProps {
  readonly store: Store;
  readonly view: PlanView | null;
}

export function Tabs({ store, view }: TabsProps) {
  const shown = TABS.filter((tab) => !(tab.needsServer && store.isStatic));
  const chosen = shown.find(({ id }) => id === store.tab.value) ?? shown[0];
  const step = (by: number): void => {
    const next = shown[(shown.indexOf(chosen) + by + shown.length) % shown.length];
    store.tab.value = next.id;
    document.getElementById(`tab-${next.id}`)?.focus();
  };
  return (
    <>
      <VerdictLine store={store} />
      <div
        class="tabs"
        role="tablist"
        aria-label={t('Panel content')}
        onKeyDown={(event) => {
          if (event.key !== 'ArrowRight' && event.key !== 'ArrowLeft') return;
          event.preventDefault();
          event.stopPropagation();
          step(event.key === 'ArrowRight' ? 1 : -1);
        }}
      >
        {shown.map(({ id, title }) => (
          <button
            key={id}
            id={`tab-${id}`}
            type="button"
            role="tab"
            aria-selected={id === chosen.id}
            aria-controls="tab-page"
            tabIndex={id === chosen.id ? 0 : -1}
            onClick={() => {
              store.tab.value = id;
            }}
          >
            {title}
          </button>
        ))}
      </div>
      <div id="tab-page" class="tab-page" role="tabpanel" aria-labelledby={`tab-${chosen.id}`}>
        {pageOf(chosen.id, { store, view })}
      </div>
    </>
  );
}

function pageOf(id: TabId, { store, view }: TabsProps): ComponentChildren {
  if (id === 'unseen') return <UnseenTab store={store} />;
  if (id === 'network') return <NetworkTab store={store} />;
  if (id === 'edit') return <EditTab store={store} view={view} />;
  if (id === 'runs') return <RunsTab store={store} view={view} />;
  if (id === 'review') return <ReviewTab store={store} view={view} />;
  return (
    <>
      <Summary store={store} view={view} />
      <FloorSelector store={store} />
      <RoomList store={store} />
      <FileList store={store} />
      <RouteSection store={store} />
      <StationList store={store} />
      <ElementSearch store={store} view={view} />
      <KeysHelp />
    </>
  );
}
