/** What can be downloaded: made by the server of the plan as reviewed, or files that the plan folder holds. */

import type { ApiClient } from '../api/client.ts';
import type { ExportList } from '../api/documents.ts';
import { t } from '../language/language.ts';
import { planUrl } from '../load/plan-base.ts';

export interface Download {
  readonly id: string;
  readonly name: string;
  readonly kind: string;
  readonly fileName: string;
  /** Of a file that is there; null: the server makes it. */
  readonly address: string | null;
  /** It is a page with pictures beside it: opened, for by itself it would be without them. */
  readonly isPage?: boolean;
  /** Why it can't be had; null: it can. */
  readonly obstacle: string | null;
}

/** What people call the formats, and in which order they look for them. */
const NAMES: Readonly<Record<string, readonly [string, string]>> = {
  csv: [t('Station list'), 'CSV'],
  pdf: [t('Sheets to print'), 'PDF'],
  html: [t('Report, one page'), 'HTML'],
  ifc: [t('Stations'), 'IFC'],
  'ifc-model': [t('Model with stations'), 'IFC'],
  bcf: [t('Issues: comments, unseen surface by room'), 'BCF 2.1'],
};

/** Of the plan folder, as `tlsplan export --format web` takes them along. */
const FILES: readonly (readonly [string, string, string])[] = [
  ['stations.csv', t('Station list'), 'CSV'],
  ['report/index.html', t('Report'), t('opens')],
  ['report/unseen.csv', t('Unseen elements'), 'CSV'],
  ['report/unseen_surfaces.csv', t('Unseen surfaces'), 'CSV'],
];

export function madeDownloads({ exports }: ExportList): readonly Download[] {
  return exports.map(({ name, title, file_name, obstacle }) => {
    const [words, kind] = NAMES[name] ?? [title, name];
    return { id: name, name: words, kind, fileName: file_name, address: null, obstacle: obstacle ?? null };
  });
}

/** Files that the plan folder `base` holds: those that are not there are not offered. */
export async function heldDownloads(
  base: string,
  ask: (address: string) => Promise<{ readonly ok: boolean }> = isThere,
): Promise<readonly Download[]> {
  const found = await Promise.all(
    FILES.map(async ([path, name, kind]) => {
      const address = planUrl(base, path);
      const isHeld = await ask(address).then(
        ({ ok }) => ok,
        () => false,
      );
      const fileName = path.replace(/^.*\//, '');
      return isHeld
        ? [{ id: path, name, kind, fileName, address, obstacle: null, isPage: path.endsWith('.html') }]
        : [];
    }),
  );
  return found.flat();
}

/** Asked with GET, which is all that a device without network answers; the content is not waited for. */
async function isThere(address: string): Promise<{ readonly ok: boolean }> {
  const response = await fetch(address);
  await response.body?.cancel();
  return response;
}

/** Have the server make one; what it remarks. */
export async function make(
  client: ApiClient,
  { id, fileName }: Download,
  signal: AbortSignal,
  save: (content: Blob, fileName: string) => void = saveFile,
): Promise<readonly string[]> {
  const { content, remarks } = await client.file(`exports/${id}`, signal);
  save(content, fileName);
  return remarks;
}

/** Hand a file to the browser, as a download. */
export function saveFile(content: Blob, fileName: string): void {
  const address = URL.createObjectURL(content);
  const link = document.createElement('a');
  link.href = address;
  link.download = fileName;
  link.click();
  // The browser has begun to read it by then.
  window.setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
