/** A stand-in for the review's part of the server: comments and moves of stations, revisions and conflicts. */
import type { Change, Comment, LastChange, LiveState, Review, StationEdit } from '../api/documents.ts';

export const EMPTY_REVIEW: Review = {
  revision: 0,
  stations: {},
  forbidden: {},
  zones: {},
  ground_picks: {},
  entrances: {},
  doors: {},
  comments: {},
  verdicts: {},
  progress: {},
  sign_off: null,
  touched: {},
};

/** An edit of a station that changes nothing but what is given. */
export const stationEdit = (changes: Partial<StationEdit>): StationEdit => ({
  position_m: null,
  instrument_height_m: null,
  floor: null,
  added: false,
  removed: false,
  locked: null,
  ...changes,
});

const EMPTY_EDIT: StationEdit = {
  position_m: null,
  instrument_height_m: null,
  floor: null,
  added: false,
  removed: false,
  locked: null,
};

interface ChangesRequest {
  readonly base_revision: number;
  readonly author: string;
  readonly changes: readonly Change[];
}

export class FakeReviewServer {
  review: Review = EMPTY_REVIEW;
  /** Requests in the order they came, as "METHOD path". */
  readonly asked: string[] = [];
  /** Called with every request before it is answered. */
  onAsked: (what: string) => void = () => undefined;
  isGone = false;
  /** What everything is refused with; null: nothing is. */
  refusal: { readonly status: number; readonly message: string } | null = null;
  planSha256 = '0'.repeat(64);
  runs: { runs: readonly { readonly id: string }[]; obstacle: string | null } = { runs: [], obstacle: null };
  live: LiveState = { state: 'off', step: null, fraction: null, message: 'no scene' };

  readonly fetch = async (address: string, options?: RequestInit): Promise<Response> => {
    const what = `${options?.method ?? 'GET'} ${address}`;
    this.asked.push(what);
    this.onAsked(what);
    if (this.isGone) throw new TypeError('connection refused');
    if (this.refusal !== null) return json(this.refusal.status, { message: this.refusal.message });
    if (address === 'api/runs') return json(200, this.runs);
    if (address === 'api/session') return json(200, this.session());
    if (address === 'api/review') return json(200, this.review);
    if (address === 'api/review/changes') return this.change(JSON.parse(String(options?.body)) as ChangesRequest);
    return json(404, { message: 'not found' });
  };

  /** Somebody else's changes. */
  changeAs(author: string, ...changes: readonly Change[]): void {
    this.apply(author, changes);
  }

  private session() {
    return {
      schema: 'tlsplan/api/1',
      plan_sha256: this.planSha256,
      revision: this.review.revision,
      read_only: false,
      comment_only: false,
      live: this.live,
    };
  }

  private change({ base_revision, author, changes }: ChangesRequest): Response {
    const touched = changes.map(objectOf).map((object) => [object, this.review.touched[object]] as const);
    const newer = touched.filter(([, touch]) => touch !== undefined && touch.revision > base_revision);
    if (newer.length > 0) {
      const conflicts = newer.map(([object, touch]) => ({ object, by: touch.by, at: touch.at }));
      return json(409, { message: 'changed meanwhile', conflicts, review: this.review });
    }
    const undo = this.apply(author, changes);
    return json(200, { revision: this.review.revision, undo, review: this.review });
  }

  private apply(author: string, changes: readonly Change[]): Change[] {
    const undo: Change[] = [];
    const revision = this.review.revision + 1;
    const touched: Record<string, LastChange> = { ...this.review.touched };
    for (const change of changes) {
      undo.unshift(this.applyOne(author, change));
      touched[objectOf(change)] = { revision, by: author, at: '2026-11-21T16:30:00Z' };
    }
    this.review = { ...this.review, revision, touched };
    return undo;
  }

  private applyOne(author: string, change: Change): Change {
    const { stations, comments } = this.review;
    if (change.kind === 'move_station') {
      const id = change.station;
      const before = stations[id] ?? EMPTY_EDIT;
      const { position_m } = change;
      this.review = { ...this.review, stations: { ...stations, [id]: { ...before, position_m } } };
      return { kind: 'move_station', station: id, position_m: before.position_m };
    }
    if (change.kind === 'add_station') {
      const { position_m, instrument_height_m = null, floor } = change;
      const id = `S10${Object.keys(stations).length}`;
      const edit: StationEdit = { ...EMPTY_EDIT, added: true, position_m, instrument_height_m, floor };
      this.review = { ...this.review, stations: { ...stations, [id]: edit } };
      return { kind: 'remove_station', station: id };
    }
    if (change.kind === 'add_comment') {
      const id = change.id ?? `C00${Object.keys(comments).length + 1}`;
      const { text } = change;
      const comment: Comment = {
        id,
        text,
        author,
        time: '2026-11-21T16:30:00Z',
        target: null,
        position_m: null,
        resolved: false,
        assignee: '',
        due: '',
        photo: '',
      };
      this.review = { ...this.review, comments: { ...comments, [id]: comment } };
      return { kind: 'remove_comment', id };
    }
    if (change.kind === 'remove_comment') {
      const { [change.id]: gone, ...kept } = comments;
      this.review = { ...this.review, comments: kept };
      return { kind: 'add_comment', id: gone.id, text: gone.text };
    }
    throw new Error(`the stand-in knows no ${change.kind}`);
  }
}

function objectOf(change: Change): string {
  if (change.kind === 'move_station') return `station:${change.station}`;
  if (change.kind === 'add_station') return 'station:new';
  if (change.kind === 'remove_comment') return `comment:${change.id}`;
  if (change.kind === 'add_comment') return `comment:${change.id ?? change.text}`;
  throw new Error(`the stand-in knows no ${change.kind}`);
}

function json(status: number, body: unknown): Response {
  return new Response(JSON.stringify(body), { status, headers: { 'content-type': 'application/json' } });
}
