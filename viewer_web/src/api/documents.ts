/** The documents that the server and the viewer exchange; positions are in the scene frame, metres. */

export type Point = readonly [number, number, number];
export type Corner = readonly [number, number];

export interface LiveState {
  readonly state: 'starting' | 'ready' | 'failed' | 'off';
  readonly step?: string | null;
  readonly fraction?: number | null;
  readonly message?: string | null;
}

export interface Session {
  readonly schema: string;
  readonly plan_sha256: string;
  readonly revision: number;
  readonly read_only: boolean;
  readonly live: LiveState;
}

/** Null: as in the plan, which has no such station where it was `added`. */
export interface StationEdit {
  readonly position_m: Point | null;
  readonly instrument_height_m: number | null;
  readonly floor: string | null;
  readonly added: boolean;
  readonly removed: boolean;
  readonly locked: boolean | null;
}

export interface ForbiddenPlace {
  readonly id: string;
  readonly position_m: Point;
  readonly radius_m: number;
  readonly floor: string;
}

export type ZoneKind = 'keep_out' | 'priority';

export interface Zone {
  readonly id: string;
  readonly kind: ZoneKind;
  readonly outline_m: readonly Corner[];
  readonly floor: string;
  readonly name: string;
  readonly coverage: number | null;
}

export interface GroundPick {
  readonly point_m: Point;
  readonly is_ground: boolean;
  readonly floor: string;
}

export interface Comment {
  readonly id: string;
  readonly text: string;
  readonly author: string;
  readonly time: string;
  /** A station's id, an element's index, or null: the plan. */
  readonly target: string | number | null;
  readonly position_m: Point | null;
  readonly resolved: boolean;
}

export interface Verdict {
  readonly verdict: 'accepted' | 'rejected';
  readonly by: string;
  readonly time: string;
  readonly note: string;
}

export interface SignOff {
  readonly name: string;
  readonly time: string;
  readonly plan_sha256: string;
  readonly revision: number;
  readonly note: string;
}

/** When an object was last changed, and by whom. */
export interface Touch {
  readonly revision: number;
  readonly by: string;
  readonly at: string;
}

export interface Review {
  readonly revision: number;
  readonly stations: Readonly<Record<string, StationEdit>>;
  readonly forbidden: Readonly<Record<string, ForbiddenPlace>>;
  readonly zones: Readonly<Record<string, Zone>>;
  readonly ground_picks: Readonly<Record<string, GroundPick>>;
  readonly comments: Readonly<Record<string, Comment>>;
  readonly verdicts: Readonly<Record<string, Verdict>>;
  readonly sign_off: SignOff | null;
  /** By `station:S001`, `zone:Z001`, `forbidden:P001`, `pick:G001`, `comment:C001`, `verdict:S001`, `sign_off`. */
  readonly touched: Readonly<Record<string, Touch>>;
}

/** One change of the review; what it is about depends on `kind`. */
export type Change = { readonly kind: string; readonly [key: string]: unknown };

export interface Conflict {
  readonly object: string;
  readonly by: string;
  readonly at: string;
}

export interface Committed {
  readonly revision: number;
  readonly undo: readonly Change[];
  readonly review: Review;
}

export interface ConflictAnswer {
  readonly message: string;
  readonly conflicts: readonly Conflict[];
  readonly review: Review;
}

export interface DraftFigures {
  readonly revision: number;
  readonly coverage: CoverageFigures;
  readonly floors: readonly ({ readonly floor: string } & CoverageFigures)[];
  readonly stations: readonly FiguresOfStation[];
  readonly registration: {
    readonly connected: boolean;
    readonly threshold: number;
    readonly links: readonly DraftLink[];
    readonly networks: readonly { readonly stations: readonly string[] }[];
  };
  readonly curve: readonly number[];
}

export interface CoverageFigures {
  readonly achievable_area_m2: number;
  readonly covered_area_m2: number;
  readonly total_area_m2: number;
  readonly fraction_of_achievable: number;
}

export interface FiguresOfStation {
  readonly id: string;
  readonly covered_area_m2: number;
  readonly own_area_m2: number;
}

export interface DraftLink {
  readonly a: string;
  readonly b: string;
  readonly overlap: number;
  readonly strength: number | null;
}

export interface RunBest {
  readonly n_stations: number;
  readonly lower_bound: number | null;
  readonly fraction_of_achievable: number | null;
  readonly stations: readonly Point[];
}

export interface Run {
  readonly id: string;
  readonly title: string;
  readonly state: 'running' | 'finished' | 'cancelled' | 'failed';
  readonly created: string;
  readonly stage: string | null;
  readonly done: number | null;
  readonly total: number | null;
  readonly note: string | null;
  readonly best: RunBest | null;
  readonly message: string | null;
  readonly plan: string | null;
}
