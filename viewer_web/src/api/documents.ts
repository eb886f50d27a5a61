/** The documents that the server and the viewer exchange, as nobody may change them; positions are in the scene frame, metres. */
import type * as schema from './schema.ts';

export type Frozen<T> = T extends object ? { readonly [Key in keyof T]: Frozen<T[Key]> } : T;

export type Point = readonly [number, number, number];

export type Session = Frozen<schema.SessionDocument>;
export type LiveState = Frozen<schema.LiveDocument>;

/** As the server sends it: what may be left out of a change is all there. */
type Sent<T> = T extends object ? { [Key in keyof T]-?: Sent<T[Key]> } : T;

export type Review = Frozen<Sent<schema.Review>>;
export type StationEdit = Frozen<Sent<schema.StationEdit>>;
export type Comment = Frozen<Sent<schema.Comment>>;
export type LastChange = Frozen<schema.LastChange>;
export type ZoneKind = schema.Zone['kind'];

export type PhotoAnswer = Frozen<schema.PhotoDocument>;

/** One change of the review. */
export type Change = Frozen<schema.Changes['changes'][number]>;
export type Committed = Frozen<Omit<schema.CommittedDocument, 'review'>> & { readonly review: Review };
export type ConflictAnswer = Frozen<Omit<schema.ConflictDocument, 'review'>> & { readonly review: Review };

export type PreviewHead = Frozen<schema.PreviewHead>;
export type PreviewQuestion = Frozen<schema.PreviewQuestion>;
export type GroundHead = Frozen<schema.GroundHead>;
export type DraftLink = Frozen<schema.Link>;

export type CloudHead = Frozen<schema.CloudHead>;

/** Figures of the draft. */
export type DraftFigures = Frozen<schema.FiguresOfDraft>;
export type DraftRoute = Frozen<schema.RouteOfDraft>;

export type RunBest = Frozen<Required<schema.RunBest>>;
/** As the server sends it. */
export type Run = Frozen<Required<Omit<schema.RunDocument, 'best'>>> & { readonly best: RunBest | null };
/** All of them. obstacle : why no run can be started; null: nothing is known of. */
export type RunList = { readonly runs: readonly Run[]; readonly obstacle: string | null };
/** What can be had of the plan as reviewed. */
export type ExportList = Frozen<schema.ExportList>;
export type RunRequest = Frozen<Required<schema.RunRequest>>;

/** What was recognised in drawings, as corrected. */
export type Drawn = Frozen<Sent<schema.DrawnBuilding>>;
export type DrawnStorey = Drawn['storeys'][number];
export type DrawnWall = DrawnStorey['walls'][number];
export type DrawnOpening = DrawnStorey['openings'][number];
/** All that is drawn of a storey, and where its picture is. */
export type DrawnLinesAnswer = Frozen<schema.DrawnLinesDocument>;
export type DrawnRoom = Frozen<schema.DrawnRoom>;
/** The drawing of the plan, null: it was made from a model; and the rooms of each storey. */
export type DrawingAnswer = Frozen<Omit<schema.DrawingDocument, 'drawing'>> & { readonly drawing: Drawn | null };
