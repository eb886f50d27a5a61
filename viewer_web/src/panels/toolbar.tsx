/**
 * The one bar over the picture: how it is looked at and painted, what is shown, tools, and what can be taken along. In narrow
 * windows it lies below the page, and each group opens with its words.
 */
import { useSignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { chooseHatching, isHatched } from '../heat/hatching.ts';
import { PLAIN } from '../heat/layers.ts';
import { t } from '../language/language.ts';
import { hasSection, togglePanel } from '../measure/panel.ts';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import { ShareMenu } from '../share/share-menu.tsx';
import type { Store } from '../store.ts';
import { SavedViews } from '../views/views-menu.tsx';
import { Icon, type IconName } from './icons.tsx';
import { Popover } from './popover.tsx';
import { useRoving } from './roving.ts';
import { Tip, tipOf } from './tip.tsx';
import { chooseUnits, units } from './units.ts';

/** No floor's id is empty. */
const ALL_FLOORS = '';
/** As in style.css: where the panel is below the picture. */
const NARROW = '(max-width: 820px)';

interface Props {
  readonly store: Store;
  readonly view: PlanView;
}

export function Toolbar({ store, view }: Props) {
  const bar = useRef<HTMLDivElement>(null);
  const isNarrow = useNarrow();
  useRoving(bar);
  const groups = groupsOf({ store, view });
  return (
    <div class={isNarrow ? 'toolbar toolbar-below' : 'toolbar'} role="toolbar" aria-label={t('Picture')} ref={bar}>
      {isNarrow ? (
        groups.map((group) => <GroupMenu key={group.id} {...group} panel={panelAction(store)} />)
      ) : (
        <>
          <div class="tool-group">
            <ToolButton {...panelAction(store)} />
          </div>
          {groups.map(({ id, name, choice, actions, more }) => (
            // biome-ignore lint/a11y/useSemanticElements: no fieldset: it holds no fields of a form.
            <div key={id} class="tool-group" role="group" aria-label={name}>
              {choice}
              {actions.map((action) => (
                <ToolButton key={action.id} {...action} />
              ))}
              {more !== undefined && (
                <Popover
                  {...{
                    id: 'views-menu',
                    name: t('Views'),
                    icon: 'views',
                    className: 'views-menu',
                    title: t('Saved views'),
                  }}
                  hint={t('Views: save this one, come back to another')}
                >
                  {more}
                </Popover>
              )}
            </div>
          ))}
        </>
      )}
      <ShareMenu store={store} view={view} />
      {!isNarrow && <Tip bar={bar} />}
    </div>
  );
}

/** With the panel's button among those of the view: there is no room for one more. */
function GroupMenu({ id, name, hint, icon, choice, actions, more, panel }: Group & { readonly panel: Action }) {
  return (
    <Popover id={`${id}-menu`} name={name} hint={hint} icon={icon} title={hint} className="group-menu">
      {(close) => (
        <>
          {choice}
          {[...actions, ...(id === 'view' ? [panel] : [])].map((action) => (
            <ToolButton key={action.id} {...action} onDone={close} />
          ))}
          {more?.(close)}
        </>
      )}
    </Popover>
  );
}

function useNarrow(): boolean {
  const isNarrow = useSignal(window.matchMedia(NARROW).matches);
  useEffect(() => {
    const query = window.matchMedia(NARROW);
    const follow = (): void => {
      isNarrow.value = query.matches;
    };
    follow();
    query.addEventListener('change', follow);
    return () => query.removeEventListener('change', follow);
  }, [isNarrow]);
  return isNarrow.value;
}

interface Action {
  readonly id: string;
  readonly name: string;
  readonly hint: string;
  readonly key?: string;
  readonly icon: IconName;
  /** Why it is switched off; null: it is not. */
  readonly off?: string | null;
  /** Undefined: it is no switch. */
  readonly isOn?: boolean;
  /** Undefined: it opens nothing. */
  readonly isExpanded?: boolean;
  readonly run: () => void;
}

interface Group {
  readonly id: string;
  readonly name: string;
  /** What is in it. */
  readonly hint: string;
  readonly icon: IconName;
  readonly choice: ComponentChildren;
  readonly actions: readonly Action[];
  /** In narrow windows below them, else what the button behind them opens. */
  readonly more?: (close: () => void) => ComponentChildren;
}

function groupsOf({ store, view }: Props): readonly Group[] {
  const off = whyNoPicture(store);
  const { panel } = store.measuring;
  return [
    {
      id: 'view',
      name: t('View'),
      hint: t('Floor and view'),
      icon: 'view',
      choice: <FloorSelect store={store} />,
      actions: viewActions({ store, view }, off),
      more: (close) => <SavedViews store={store} view={view} close={close} />,
    },
    {
      id: 'colour',
      name: t('Colour'),
      hint: t('Colour of the building'),
      icon: 'colour',
      choice: <LayerSelect store={store} />,
      actions: [
        {
          ...{ id: 'tool-hatch', name: t('Hatch'), icon: 'hatch' },
          hint: t('Hatch what no station sees, to tell it without its colour'),
          off,
          isOn: isHatched.value,
          run: () => chooseHatching(window.localStorage, !isHatched.value),
        },
      ],
    },
    {
      id: 'show',
      name: t('Show'),
      hint: t('What is shown'),
      icon: 'show',
      choice: null,
      actions: showActions(store, off),
    },
    {
      id: 'tools',
      name: t('Tools'),
      hint: t('Measure and cut'),
      icon: 'tools',
      choice: null,
      actions: [
        {
          ...{ id: 'site-tool-measure', name: t('Measure'), key: 'M', icon: 'measure' },
          hint: t('Distances, heights, angles and areas'),
          isOn: panel.value === 'measure',
          isExpanded: panel.value === 'measure',
          run: () => togglePanel(store, view, 'measure'),
        },
        {
          ...{ id: 'site-tool-section', name: t('Section'), icon: 'section' },
          hint: t('Cut the building with a box, or along a line on the plan'),
          off: hasSection(store) ? null : off,
          isOn: panel.value === 'section' || hasSection(store),
          isExpanded: panel.value === 'section',
          run: () => togglePanel(store, view, 'section'),
        },
      ],
    },
  ];
}

function viewActions({ store, view }: Props, off: string | null): Action[] {
  const { isPlanView, isWalking } = store;
  return [
    {
      ...{ id: 'tool-3d', name: '3D', key: 'H', icon: 'cube' },
      hint: t('Whole building, from the side'),
      off,
      run: () => view.showAll('side'),
    },
    {
      ...{ id: 'tool-top', name: t('Top'), key: 'T', icon: 'top' },
      hint: t('Top view'),
      run: () => view.showAll('top'),
    },
    {
      ...{ id: 'tool-plan', name: t('Plan view'), key: 'P', icon: 'plan' },
      hint: t('Straight from above, to scale, with grid and north'),
      off,
      isOn: isPlanView.value,
      run: () => (isPlanView.value ? view.showAll('side') : view.showPlan()),
    },
    {
      ...{ id: 'tool-walk', name: t('Walk'), key: 'W', icon: 'walk' },
      hint: t('Walk through the building at eye height'),
      off,
      isOn: isWalking.value,
      run: () => (isWalking.value ? view.walk.leave() : view.startWalk()),
    },
  ];
}

function panelAction({ isSidebarOpen }: Store): Action {
  const name = isSidebarOpen.value ? t('Hide the panel') : t('Show the panel');
  return {
    ...{ id: 'tool-panel', icon: 'panel', name, hint: name },
    isExpanded: isSidebarOpen.value,
    run: () => {
      isSidebarOpen.value = !isSidebarOpen.value;
    },
  };
}

function showActions({ showLinks, showClouds }: Store, off: string | null): Action[] {
  return [
    {
      ...{ id: 'tool-links', name: t('Links'), icon: 'links' },
      hint: t('Lines between stations that overlap enough to register'),
      isOn: showLinks.value,
      run: () => {
        showLinks.value = !showLinks.value;
      },
    },
    {
      ...{ id: 'tool-clouds', name: t('Clouds'), icon: 'clouds' },
      hint: t('Point clouds of all stations on the shown floors'),
      off,
      isOn: showClouds.value,
      run: () => {
        showClouds.value = !showClouds.value;
      },
    },
    {
      ...{ id: 'tool-feet', name: t('Feet'), icon: 'feet' },
      hint: t('Lengths, areas and coordinates in feet and inches'),
      isOn: units.value === 'ft',
      run: () => chooseUnits(window.localStorage, units.value === 'ft' ? 'm' : 'ft'),
    },
  ];
}

/** onDone : called after what is no switch of the picture: where it opened, that is over. */
function ToolButton(action: Action & { readonly onDone?: () => void }) {
  const { id, name, hint, key, icon, off = null, isOn, isExpanded, run, onDone } = action;
  return (
    <button
      id={id}
      type="button"
      class="tool-button"
      aria-label={name}
      aria-pressed={isOn}
      aria-expanded={isExpanded}
      disabled={off !== null}
      // What is switched off has no pointer of its own to rest on it.
      {...(off === null ? tipOf(hint === name ? name : `${name}: ${hint}`, key) : { title: off })}
      onClick={() => {
        run();
        if (isOn === undefined || isExpanded !== undefined) onDone?.();
      }}
    >
      <Icon name={icon} />
      <span class="tool-name">{name}</span>
    </button>
  );
}

function FloorSelect({ store }: { store: Store }) {
  return (
    <label class="tool-select">
      <span class="muted">{t('Floor')}</span>
      <select
        aria-label={t('Shown floor')}
        value={store.floorId.value ?? ALL_FLOORS}
        onChange={({ currentTarget: { value } }) => store.chooseFloor(value === ALL_FLOORS ? null : value)}
      >
        <option value={ALL_FLOORS}>{t('All floors')}</option>
        {[...(store.loaded.value?.stage.floors ?? [])].reverse().map(({ id, name }) => (
          <option key={id} value={id}>
            {name}
          </option>
        ))}
      </select>
    </label>
  );
}

function LayerSelect({ store }: { store: Store }) {
  const off = whyNoPicture(store);
  return (
    <label class="tool-select" title={off ?? undefined}>
      <span class="muted">{t('Colour')}</span>
      <select
        aria-label={t('Colour of the building')}
        disabled={off !== null}
        value={store.layerId.value}
        onChange={(event) => {
          store.layerId.value = event.currentTarget.value;
        }}
      >
        {store.layers.value.map(({ id, title }) => (
          <option key={id} value={id}>
            {title}
          </option>
        ))}
        <option value={PLAIN}>{t('Plain')}</option>
        {store.loaded.value?.layers === null && (
          <option disabled>{t('Ranges and reasons: made by an older version, plan again')}</option>
        )}
      </select>
    </label>
  );
}
