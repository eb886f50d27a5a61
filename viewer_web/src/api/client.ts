/** Asks the server: one method a route of docs/viewer-api.md; what it refuses comes as `ApiError` with the server's own words. */
import { t } from '../language/language.ts';
import { ApiError, NO_ANSWER, NO_TOKEN } from './api-error.ts';
import type { Change, Committed, ConflictAnswer, PhotoAnswer, Review, Session } from './documents.ts';
import { type Framed, readFramed } from './framing.ts';

export type Fetcher = (address: string, options?: RequestInit) => Promise<Response>;

/** What became of changes: taken, or somebody changed the same before. */
export type CommitOutcome =
  | { readonly kind: 'committed'; readonly answer: Committed }
  | { readonly kind: 'conflict'; readonly answer: ConflictAnswer };

export class ApiClient {
  constructor(
    private readonly fetcher: Fetcher = (address, options) => window.fetch(address, options),
    /** Relative to the page, as all addresses are. */
    private readonly base = 'api/',
  ) {}

  session(): Promise<Session> {
    return this.json('session');
  }

  review(): Promise<Review> {
    return this.json('review');
  }

  /** `basis`: the plan and the revision that the changes were decided on. */
  async commit(
    basis: { readonly revision: number; readonly planSha256: string | null },
    author: string,
    changes: readonly Change[],
  ): Promise<CommitOutcome> {
    const body = { base_revision: basis.revision, plan_sha256: basis.planSha256, author, changes };
    const response = await this.ask('review/changes', { method: 'POST', body });
    if (response.status === 409) return { kind: 'conflict', answer: await parsed<ConflictAnswer>(response) };
    return { kind: 'committed', answer: await parsed<Committed>(await answered(response)) };
  }

  /** GET a JSON document. */
  async json<T>(path: string): Promise<T> {
    return parsed<T>(await answered(await this.ask(path)));
  }

  /** POST a JSON document and get one. */
  async post<T>(path: string, body: unknown, signal?: AbortSignal): Promise<T> {
    return parsed<T>(await answered(await this.ask(path, { method: 'POST', body, ...(signal ? { signal } : {}) })));
  }

  /** Keep a photo for a comment; returns its SHA-256. */
  async keepPhoto(photo: Blob): Promise<string> {
    const response = await answered(await this.ask('review/photos', { method: 'POST', body: photo }));
    return (await parsed<PhotoAnswer>(response)).sha256;
  }

  async delete(path: string): Promise<void> {
    await answered(await this.ask(path, { method: 'DELETE' }));
  }

  async bytes(path: string, signal?: AbortSignal): Promise<ArrayBuffer> {
    const response = await answered(await this.ask(path, signal ? { signal } : {}));
    return response.arrayBuffer();
  }

  /** A file that the server makes, and what it remarks on it, a line each. */
  async file(
    path: string,
    signal: AbortSignal,
  ): Promise<{ readonly content: Blob; readonly remarks: readonly string[] }> {
    const response = await answered(await this.ask(path, { signal }));
    const remarks = decodeURIComponent(response.headers.get('x-tlsplan-remarks') ?? '');
    return { content: await response.blob(), remarks: remarks.split('\n').filter((line) => line !== '') };
  }

  async framed<Head>(path: string, signal?: AbortSignal): Promise<Framed<Head>> {
    return readFramed<Head>(await this.bytes(path, signal));
  }

  async postFramed<Head>(path: string, body: unknown, signal?: AbortSignal): Promise<Framed<Head>> {
    const response = await answered(await this.ask(path, { method: 'POST', body, ...(signal ? { signal } : {}) }));
    return readFramed<Head>(await response.arrayBuffer());
  }

  private async ask(
    path: string,
    { method = 'GET', body, signal }: { method?: string; body?: unknown; signal?: AbortSignal } = {},
  ): Promise<Response> {
    const options: RequestInit = { method, credentials: 'same-origin' };
    if (signal !== undefined) options.signal = signal;
    if (body !== undefined) {
      const isPhoto = body instanceof Blob;
      options.body = isPhoto ? body : JSON.stringify(body);
      options.headers = { 'content-type': isPhoto ? 'image/jpeg' : 'application/json' };
    }
    try {
      return await this.fetcher(this.base + path, options);
    } catch (error) {
      if (signal?.aborted) throw error;
      throw new ApiError(0, NO_ANSWER);
    }
  }
}

/** The response, where the server did what was asked. */
async function answered(response: Response): Promise<Response> {
  if (response.ok) return response;
  if (response.status === 401) throw new ApiError(401, NO_TOKEN);
  throw new ApiError(response.status, await wordsOf(response));
}

/** The server's words: `message` or `detail` of a JSON answer, or its text. */
async function wordsOf(response: Response): Promise<string> {
  const text = (await response.text()).trim();
  let words: unknown = text;
  try {
    const json = JSON.parse(text) as { message?: unknown; detail?: unknown };
    words = json.message ?? json.detail ?? text;
  } catch {
    // Not JSON: the text itself is for people.
  }
  return typeof words === 'string' && words !== ''
    ? words
    : t('The server answered {status}.', { status: response.status });
}

async function parsed<T>(response: Response): Promise<T> {
  try {
    return (await response.json()) as T;
  } catch {
    throw new ApiError(
      0,
      t("The server's answer can't be read. Reload the page; the server may be of another version."),
    );
  }
}
