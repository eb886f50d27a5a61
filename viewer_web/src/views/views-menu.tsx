/** Views with names: to save the one that is shown, and to come back to it. */

import { useEffect, useRef, useState } from 'preact/hooks';
import { t } from '../language/language.ts';
import { closeOnEscape } from '../panels/escape.ts';
import { Icon, type IconName } from '../panels/icons.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import { copied, linkOf } from '../share/link.ts';
import { LinkField } from '../share/link-field.tsx';
import type { Store } from '../store.ts';
import { formatUrlState } from '../url-state.ts';
import {
  freeName,
  hashToKeep,
  LONGEST_NAME,
  readViews,
  renamed,
  type SavedView,
  stateOfView,
  viewsKey,
  withView,
  writeViews,
} from './saved-views.ts';
import './views.css';

interface MenuProps {
  readonly store: Store;
  readonly view: PlanView;
  readonly close: () => void;
}

const storage = (): Storage => window.localStorage;

export function SavedViews({ store, view, close }: MenuProps) {
  const key = store.loaded.value === null ? '' : viewsKey(store.loaded.value.plan.scene);
  const [views, setViews] = useState<readonly SavedView[]>(() => readViews(storage, key) ?? []);
  const [note, setNote] = useState(() =>
    readViews(storage, key) === null ? t('The views that this browser keeps cannot be read.') : null,
  );
  const [link, setLink] = useState<string | null>(null);
  const [edited, setEdited] = useState<string | null>(null);
  /** Of the views as they are kept now: another window may have added some. */
  const change = (make: (kept: readonly SavedView[]) => readonly SavedView[] | string): boolean => {
    const made = make(readViews(storage, key) ?? []);
    const isKept = typeof made !== 'string' && writeViews(storage, key, made);
    if (isKept) setViews(made);
    setNote(typeof made === 'string' ? made : isKept ? null : t('The browser has no room for it, or keeps nothing.'));
    setLink(null);
    return isKept;
  };
  const go = (saved: SavedView): void => {
    // Otherwise the walk would keep the camera.
    view.walk.end();
    window.location.hash = formatUrlState(stateOfView(saved, window.location.hash));
    close();
  };
  const copy = async (saved: SavedView): Promise<void> => {
    const to = linkOf(window.location, stateOfView(saved, window.location.hash));
    const isCopied = await copied(to, navigator.clipboard as Clipboard | undefined);
    setLink(isCopied ? null : to);
    setNote(isCopied ? t('Copied.') : t('The browser did not let it be copied: copy it from here.'));
  };
  return (
    <div class="views">
      <h2>{t('Saved views')}</h2>
      <SaveForm
        suggested={freeName(suggestedName(store), views)}
        onSave={(name) => change((kept) => withView(kept, name, hashToKeep(window.location.hash, view.pose())))}
      />
      {views.length > 0 && (
        <ul>
          {views.map((saved) =>
            saved.name === edited ? (
              <RenameItem
                key={saved.name}
                name={saved.name}
                onName={(name) => {
                  if (name !== null) change((kept) => renamed(kept, saved.name, name));
                  setEdited(null);
                }}
              />
            ) : (
              <li key={saved.name}>
                <button type="button" class="views-name" title={saved.name} onClick={() => go(saved)}>
                  <span>{saved.name}</span>
                </button>
                <SmallButton
                  icon="link"
                  name={t('Copy link to {name}', { name: saved.name })}
                  onClick={() => void copy(saved)}
                />
                <SmallButton
                  icon="rename"
                  name={t('Rename {name}', { name: saved.name })}
                  onClick={() => setEdited(saved.name)}
                />
                <SmallButton
                  icon="remove"
                  name={t('Delete {name}', { name: saved.name })}
                  onClick={() => change((kept) => kept.filter(({ name }) => name !== saved.name))}
                />
              </li>
            ),
          )}
        </ul>
      )}
      {link !== null && <LinkField link={link} />}
      <p class="note" role="status">
        {note ?? (views.length === 0 && t('Floor, camera, colours, sections and what is shown, kept by this browser.'))}
      </p>
    </div>
  );
}

/** What is shown in a few words. */
function suggestedName({ loaded, floorId, layers, layerId }: Store): string {
  const floor = loaded.value?.stage.floors.find(({ id }) => id === floorId.value)?.name ?? t('All floors');
  const layer = layers.value.find(({ id }) => id === layerId.value)?.title ?? t('Plain');
  return `${floor}, ${layer}`;
}

interface SaveFormProps {
  readonly suggested: string;
  readonly onSave: (name: string) => boolean;
}

function SaveForm({ suggested, onSave }: SaveFormProps) {
  const [name, setName] = useState('');
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (onSave(name.trim() || suggested)) setName('');
      }}
    >
      <input
        type="text"
        aria-label={t('Name of the view')}
        placeholder={suggested}
        maxLength={LONGEST_NAME}
        value={name}
        onInput={({ currentTarget: { value } }) => setName(value)}
      />
      <button type="submit" class="button">
        {t('Save this view')}
      </button>
    </form>
  );
}

/** onName : called with null where the name stays. */
function RenameItem({ name, onName }: { name: string; onName: (name: string | null) => void }) {
  const field = useRef<HTMLInputElement>(null);
  useEffect(() => {
    field.current?.select();
    return closeOnEscape(() => onName(null));
  }, []);
  const take = (): void => onName(field.current?.value.trim() || null);
  return (
    <li>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          take();
        }}
      >
        <input ref={field} type="text" aria-label={t('New name')} maxLength={LONGEST_NAME} defaultValue={name} />
        <button type="submit" class="button">
          {t('Rename')}
        </button>
      </form>
    </li>
  );
}

function SmallButton({ icon, name, onClick }: { icon: IconName; name: string; onClick: () => void }) {
  return (
    <button type="button" class="views-button" aria-label={name} title={name} onClick={onClick}>
      <Icon name={icon} />
    </button>
  );
}
