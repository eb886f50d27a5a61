/** The menu of what can be taken along: a link, a picture, and the plan in formats of other programs. */

import { useEffect, useRef, useState } from 'preact/hooks';
import type { ExportList } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { counted } from '../panels/figures.ts';
import { Popover } from '../panels/popover.tsx';
import type { PlanView } from '../scene/plan-view.ts';
import { whyNoPicture } from '../scene/state.ts';
import type { Store } from '../store.ts';
import { type Download, heldDownloads, madeDownloads, make, saveFile } from './downloads.ts';
import { copied, linkTo } from './link.ts';
import { LinkField } from './link-field.tsx';
import { pictureName, takePicture } from './picture.ts';
import './share.css';

export function ShareMenu({ store, view }: { store: Store; view: PlanView }) {
  return (
    <Popover
      {...{ id: 'share-menu', name: t('Share'), icon: 'share', className: 'share' }}
      hint={t('Share: copy a link, take a picture, download the plan')}
      title={t('Share and download')}
    >
      {() => (
        <>
          <ViewItems store={store} view={view} />
          <Downloads store={store} />
        </>
      )}
    </Popover>
  );
}

function ViewItems({ store, view }: { store: Store; view: PlanView }) {
  const [link, setLink] = useState<string | null>(null);
  const [said, setSaid] = useState<string | null>(null);
  const copy = async (): Promise<void> => {
    const to = linkTo(window.location, view.pose());
    const isCopied = await copied(to, navigator.clipboard as Clipboard | undefined);
    setLink(to);
    const whose = store.isStatic
      ? ''
      : ` ${t('It opens for whoever opened an address of `tlsplan view` in their browser before.')}`;
    setSaid(`${isCopied ? t('Copied.') : t('The browser did not let it be copied: copy it from here.')}${whose}`);
  };
  const picture = async (): Promise<void> => {
    try {
      saveFile(await takePicture(store, view), pictureName(store));
      setSaid(null);
    } catch (error) {
      setSaid((error as Error).message);
    }
    setLink(null);
  };
  return (
    <>
      <h2>{t('This view')}</h2>
      <ul>
        <Item name={t('Copy link')} kind="" obstacle={null} onClick={copy} />
        <Item name={t('Picture')} kind="PNG" obstacle={whyNoPicture(store)} onClick={picture} />
      </ul>
      {link !== null && <LinkField link={link} />}
      {said !== null && (
        <p class="note" role="status">
          {said}
        </p>
      )}
    </>
  );
}

type Offer =
  | { readonly kind: 'asking' }
  | { readonly kind: 'failed'; readonly message: string }
  | { readonly kind: 'there'; readonly downloads: readonly Download[]; readonly edited: number };

function Downloads({ store }: { store: Store }) {
  const [offer, setOffer] = useState<Offer>({ kind: 'asking' });
  const [making, setMaking] = useState<Download | null>(null);
  const [said, setSaid] = useState<{ readonly isBad: boolean; readonly lines: readonly string[] } | null>(null);
  const stopping = useRef<AbortController | null>(null);
  const isGone = useRef(false);
  useEffect(
    () => () => {
      isGone.current = true;
    },
    [],
  );
  const revision = store.reviewClient?.review.value?.revision;
  // What can be had changes with the review.
  useEffect(() => {
    let isOver = false;
    void offered(store).then((found) => {
      if (!isOver) setOffer(found);
    });
    return () => {
      isOver = true;
    };
  }, [store, revision]);
  // Closing the menu lets a download go on: it is what one waits for.
  const start = async (download: Download): Promise<void> => {
    const client = store.reviewClient?.client;
    if (client === undefined || making !== null) return;
    stopping.current = new AbortController();
    setMaking(download);
    setSaid(null);
    try {
      setSaid({ isBad: false, lines: await make(client, download, stopping.current.signal) });
    } catch (error) {
      const lines = stopping.current.signal.aborted ? [] : [(error as Error).message];
      if (isGone.current) for (const line of lines) store.reviewClient?.warn(line);
      else setSaid({ isBad: true, lines });
    } finally {
      setMaking(null);
    }
  };
  return (
    <>
      <h2>
        {t('Download the plan')}
        {offer.kind === 'there' && offer.edited > 0 && (
          <small> {t('as edited: {stations} changed', { stations: counted(offer.edited, 'station') })}</small>
        )}
      </h2>
      {offer.kind === 'asking' && <p class="muted">{t('Asking what can be had …')}</p>}
      {offer.kind === 'failed' && (
        <p class="note note-warn" role="alert">
          {offer.message}
        </p>
      )}
      {offer.kind === 'there' && (
        <ul>
          {offer.downloads.map((download) => (
            <DownloadItem
              key={download.id}
              download={download}
              isMaking={making?.id === download.id}
              isBusy={making !== null}
              onMake={() => void start(download)}
              onStop={() => stopping.current?.abort()}
            />
          ))}
        </ul>
      )}
      {offer.kind === 'there' && offer.downloads.length === 0 && (
        <p class="muted">{t('This copy holds no files to download.')}</p>
      )}
      {said?.lines.map((line) => (
        <p key={line} class={said.isBad ? 'note note-warn' : 'note'} role={said.isBad ? 'alert' : 'status'}>
          {line}
        </p>
      ))}
    </>
  );
}

/** Of the plan that is shown: the server makes exports of its own plan only, and a static page has no server. */
async function offered({ reviewClient, planBase, isStatic }: Store): Promise<Offer> {
  const base = planBase.value;
  if (isStatic || reviewClient === null || reviewClient.line.value === 'none' || base !== OWN_PLAN) {
    return { kind: 'there', downloads: await heldDownloads(base), edited: 0 };
  }
  try {
    const list = await reviewClient.client.json<ExportList>('exports');
    return { kind: 'there', downloads: madeDownloads(list), edited: list.edited_stations };
  } catch (error) {
    return { kind: 'failed', message: (error as Error).message };
  }
}

interface DownloadItemProps {
  readonly download: Download;
  readonly isMaking: boolean;
  readonly isBusy: boolean;
  readonly onMake: () => void;
  readonly onStop: () => void;
}

function DownloadItem({ download, isMaking, isBusy, onMake, onStop }: DownloadItemProps) {
  const { name, kind, address, fileName, obstacle, isPage } = download;
  if (address !== null) {
    return (
      <li>
        <a
          class="share-item"
          href={address}
          {...(isPage ? { target: '_blank', rel: 'noopener' } : { download: fileName })}
        >
          <span>{name}</span>
          <small>{kind}</small>
        </a>
      </li>
    );
  }
  if (isMaking) {
    return (
      <li class="share-making">
        <span role="status">{t('Making {name} …', { name })}</span>
        <progress aria-label={t('Making {name}', { name })} />
        <button type="button" class="chip" onClick={onStop}>
          {t('Stop')}
        </button>
      </li>
    );
  }
  return <Item name={name} kind={kind} isBusy={isBusy} obstacle={obstacle} onClick={onMake} />;
}

interface ItemProps {
  readonly name: string;
  readonly kind: string;
  readonly isBusy?: boolean;
  /** Why it can't be had; null: it can. */
  readonly obstacle: string | null;
  readonly onClick: () => void;
}

function Item({ name, kind, isBusy = false, obstacle, onClick }: ItemProps) {
  return (
    <li>
      <button type="button" class="share-item" disabled={isBusy || obstacle !== null} onClick={onClick}>
        <span>{name}</span>
        <small>{kind}</small>
      </button>
      {obstacle !== null && <p class="note note-warn">{obstacle}</p>}
    </li>
  );
}
