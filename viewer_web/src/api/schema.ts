/** The documents of docs/viewer-api.md. Generated of openapi.json by `npm run types`: change the models in server/ instead. */
import type * as plan from '../load/plan-types.ts';

/**
 * What doubtful elements are taken for.
 */
export type Doubtful = 'as-open' | 'as-wall';
export type FieldTimeSection = plan.FieldTimeSection;
export type FloorCoverage = plan.FloorCoverage;
export type ResultSection = plan.ResultSection;
export type StationSection = plan.StationSection;
export type RegistrationSection = plan.RegistrationSection;
export type RoomSection = plan.RoomSection;
export type PieceSection = plan.PieceSection;
export type GapSection = plan.GapSection;
export type LegSection = plan.LegSection;
export type Link = plan.Link;
export type LossSection = plan.LossSection;
export type NetworkJoin = plan.NetworkJoin;
export type NetworkSection = plan.NetworkSection;
export type PointLimits = plan.PointLimits;
/**
 * How well a scan's pose is known before it is registered: where registration starts.
 *
 * tracked: the instrument follows itself between set-ups, within some 3 cm and half a degree; manual: somebody places
 * scans by hand, within some 15 cm and 3 degrees; level: only the vertical is known; none.
 */
export type PreAlignment = 'tracked' | 'manual' | 'level' | 'none';
export type RouteSection = plan.RouteSection;
export type WeakMotion = plan.WeakMotion;

export interface Documents {
  AddComment: AddComment;
  AddEntrance: AddEntrance;
  AddStation: AddStation;
  AddZone: AddZone;
  Allow: Allow;
  AssignComment: AssignComment;
  ChangeZone: ChangeZone;
  Changes: Changes;
  ClearVerdict: ClearVerdict;
  CloudHead: CloudHead;
  Comment: Comment;
  CommittedDocument: CommittedDocument;
  ConflictDocument: ConflictDocument;
  Correction: Correction;
  CoverageFigures: CoverageFigures;
  Doubtful: Doubtful;
  DrawingDocument: DrawingDocument;
  DrawnBuilding: DrawnBuilding;
  DrawnFile: DrawnFile;
  DrawnLinesDocument: DrawnLinesDocument;
  DrawnOpening: DrawnOpening;
  DrawnRoom: DrawnRoom;
  DrawnStair: DrawnStair;
  DrawnStorey: DrawnStorey;
  DrawnText: DrawnText;
  DrawnWall: DrawnWall;
  EditComment: EditComment;
  EditConflict: EditConflict;
  Entrance: Entrance;
  ExportList: ExportList;
  FieldTimeSection: FieldTimeSection;
  FiguresOfDraft: FiguresOfDraft;
  FloorCoverage: FloorCoverage;
  Forbid: Forbid;
  ForbiddenPlace: ForbiddenPlace;
  GapSection: GapSection;
  GroundHead: GroundHead;
  GroundPick: GroundPick;
  Joined: Joined;
  LastChange: LastChange;
  LeftSurfaceSection: LeftSurfaceSection;
  LegSection: LegSection;
  Link: Link;
  LiveDocument: LiveDocument;
  LockStation: LockStation;
  LossSection: LossSection;
  MoveStation: MoveStation;
  NetworkJoin: NetworkJoin;
  NetworkSection: NetworkSection;
  OfferedExport: OfferedExport;
  PhotoDocument: PhotoDocument;
  PickGround: PickGround;
  PieceSection: PieceSection;
  PointLimits: PointLimits;
  PreAlignment: PreAlignment;
  PreviewHead: PreviewHead;
  PreviewQuestion: PreviewQuestion;
  Refusal: Refusal;
  RegistrationSection: RegistrationSection;
  RemoveComment: RemoveComment;
  RemoveEntrance: RemoveEntrance;
  RemoveStation: RemoveStation;
  RemoveZone: RemoveZone;
  RequirementFigure: RequirementFigure;
  ResolveComment: ResolveComment;
  RestoreStation: RestoreStation;
  ResultSection: ResultSection;
  Review: Review;
  RoomSection: RoomSection;
  RouteOfDraft: RouteOfDraft;
  RouteSection: RouteSection;
  RunBest: RunBest;
  RunDocument: RunDocument;
  RunList: RunList;
  RunRequest: RunRequest;
  SessionDocument: SessionDocument;
  SetDoor: SetDoor;
  SetHeight: SetHeight;
  SetProgress: SetProgress;
  SetVerdict: SetVerdict;
  Sign: Sign;
  SignOff: SignOff;
  StationAreas: StationAreas;
  StationEdit: StationEdit;
  StationProgress: StationProgress;
  StationSection: StationSection;
  UnlockStation: UnlockStation;
  UnpickGround: UnpickGround;
  Unsign: Unsign;
  Verdict: Verdict;
  WeakMotion: WeakMotion;
  Zone: Zone;
}
/**
 * Add a comment. Its id null: the next free one.
 *
 * Author and time null: whoever makes the change, now; they are there to take a removal back.
 */
export interface AddComment {
  /**
   * Plain text, 10 000 bytes of UTF-8.
   */
  text: string;
  /**
   * A station's id, an element's index in the scene, or null: the plan.
   */
  target?: string | number | null;
  position_m?: [number, number, number] | null;
  id?: string | null;
  author?: string | null;
  time?: string | null;
  resolved?: boolean;
  /**
   * Who is to deal with it; empty: nobody.
   */
  assignee?: string;
  /**
   * The day by which, 2026-12-01; empty: none.
   */
  due?: string;
  /**
   * SHA-256 of a photo; empty: none.
   */
  photo?: string;
  kind: 'add_comment';
}
/**
 * Add an entrance: the route begins at the first.
 */
export interface AddEntrance {
  entrance: Entrance;
  kind: 'add_entrance';
}
/**
 * Where the crew enters: a point on the ground of a floor.
 */
export interface Entrance {
  /**
   * Empty: the next free one.
   */
  id: string;
  /**
   * x, y, z: scene frame, metres.
   *
   * @minItems 3
   * @maxItems 3
   */
  position_m: [number, number, number];
  /**
   * Id of a floor of the plan, F0 ...
   */
  floor: string;
}
/**
 * Add a station. Its id null: the next free one.
 */
export interface AddStation {
  /**
   * x, y, z: scene frame, metres.
   *
   * @minItems 3
   * @maxItems 3
   */
  position_m: [number, number, number];
  /**
   * Id of a floor of the plan, F0 ...
   */
  floor: string;
  instrument_height_m?: number | null;
  station?: string | null;
  locked?: boolean | null;
  kind: 'add_station';
}
/**
 * Add a zone.
 */
export interface AddZone {
  zone: Zone;
  kind: 'add_zone';
}
/**
 * A drawn area: `keep_out`, or `priority` with the coverage required of it, a fraction of what is achievable.
 */
export interface Zone {
  /**
   * Empty: the next free one.
   */
  id: string;
  kind: 'keep_out' | 'priority';
  /**
   * Corners x, y of a polygon that does not cross itself.
   */
  outline_m: [number, number][];
  /**
   * Id of a floor of the plan; empty: all floors.
   */
  floor?: string;
  name?: string;
  coverage?: number | null;
}
/**
 * Allow a forbidden position again.
 */
export interface Allow {
  id: string;
  kind: 'allow';
}
/**
 * Say who deals with a comment, and by when; anybody may.
 */
export interface AssignComment {
  id: string;
  /**
   * Who is to deal with it; empty: nobody.
   */
  assignee?: string;
  /**
   * The day by which, 2026-12-01; empty: none.
   */
  due?: string;
  kind: 'assign_comment';
}
/**
 * Replace the zone of this id.
 */
export interface ChangeZone {
  zone: Zone;
  kind: 'change_zone';
}
/**
 * Changes to make together: all of them, or none.
 */
export interface Changes {
  /**
   * The revision that they were decided on.
   */
  base_revision: number;
  /**
   * Who makes them: as given, not proven.
   */
  author: string;
  changes: (
    | MoveStation
    | SetHeight
    | AddStation
    | RemoveStation
    | RestoreStation
    | LockStation
    | UnlockStation
    | Forbid
    | Allow
    | AddZone
    | ChangeZone
    | RemoveZone
    | PickGround
    | UnpickGround
    | AddEntrance
    | RemoveEntrance
    | SetDoor
    | AddComment
    | AssignComment
    | EditComment
    | ResolveComment
    | RemoveComment
    | SetVerdict
    | ClearVerdict
    | SetProgress
    | Sign
    | Unsign
  )[];
  /**
   * Of the plan that they were decided on; null: whichever it is.
   */
  plan_sha256?: string | null;
}
/**
 * Set a station's pose. Position null: back where the plan has it, height and floor too.
 *
 * Height left out: as now; null: not known. Floor null: as now.
 */
export interface MoveStation {
  /**
   * Id of a station.
   */
  station: string;
  position_m: [number, number, number] | null;
  instrument_height_m?: number | 'as_now' | null;
  floor?: string | null;
  kind: 'move_station';
}
/**
 * Raise or lower a station's sensor over the same spot.
 */
export interface SetHeight {
  /**
   * Id of a station.
   */
  station: string;
  /**
   * Of the sensor above the ground, metres.
   */
  instrument_height_m: number;
  kind: 'set_height';
}
/**
 * Remove a station.
 */
export interface RemoveStation {
  /**
   * Id of a station.
   */
  station: string;
  kind: 'remove_station';
}
/**
 * Restore a removed station of the plan.
 */
export interface RestoreStation {
  /**
   * Id of a station.
   */
  station: string;
  kind: 'restore_station';
}
/**
 * Keep a station in every new plan; null: as the plan has it; false: as `unlock_station`.
 */
export interface LockStation {
  /**
   * Id of a station.
   */
  station: string;
  locked?: boolean | null;
  kind: 'lock_station';
}
/**
 * Let new plans do without the station.
 */
export interface UnlockStation {
  /**
   * Id of a station.
   */
  station: string;
  kind: 'unlock_station';
}
/**
 * Keep stations away from a position.
 */
export interface Forbid {
  place: ForbiddenPlace;
  kind: 'forbid';
}
/**
 * A position that stations keep away from.
 */
export interface ForbiddenPlace {
  /**
   * Empty: the next free one.
   */
  id: string;
  /**
   * x, y, z: scene frame, metres.
   *
   * @minItems 3
   * @maxItems 3
   */
  position_m: [number, number, number];
  /**
   * Metres.
   */
  radius_m?: number;
  /**
   * Id of a floor of the plan; empty: all floors.
   */
  floor?: string;
}
/**
 * Remove a zone.
 */
export interface RemoveZone {
  id: string;
  kind: 'remove_zone';
}
/**
 * Mark the surface at a point as a walkable floor, or as none. Its id null: the next free one.
 */
export interface PickGround {
  pick: GroundPick;
  id?: string | null;
  kind: 'pick_ground';
}
/**
 * A surface that somebody marked as ground, or unmarked: the coplanar region around a point on it.
 *
 * point_m : on the surface, scene frame. floor : id or name; empty: the floor nearest in height, or a new one where
 * none is within reach. docs/method/floor-picking.md defines how far the region goes.
 */
export interface GroundPick {
  /**
   * x, y, z: scene frame, metres.
   *
   * @minItems 3
   * @maxItems 3
   */
  point_m: [number, number, number];
  is_ground?: boolean;
  /**
   * Id of a floor of the plan; empty: all floors.
   */
  floor?: string;
}
/**
 * Remove a mark: the surface is again what it was found to be.
 */
export interface UnpickGround {
  id: string;
  kind: 'unpick_ground';
}
/**
 * Remove an entrance.
 */
export interface RemoveEntrance {
  id: string;
  kind: 'remove_entrance';
}
/**
 * Have a door open or shut during scanning; null: as the plan has it. Counts when the plan is made again.
 */
export interface SetDoor {
  /**
   * IFC GlobalId of a door.
   */
  door: string;
  state: ('open' | 'shut') | null;
  kind: 'set_door';
}
/**
 * Edit a comment: its author may.
 */
export interface EditComment {
  id: string;
  /**
   * Plain text, 10 000 bytes of UTF-8.
   */
  text: string;
  kind: 'edit_comment';
}
/**
 * Resolve a comment, or reopen it.
 */
export interface ResolveComment {
  id: string;
  resolved?: boolean;
  kind: 'resolve_comment';
}
/**
 * Remove a comment: its author may.
 */
export interface RemoveComment {
  id: string;
  kind: 'remove_comment';
}
/**
 * Accept or reject a station. By and time null: whoever makes the change, now.
 */
export interface SetVerdict {
  /**
   * Id of a station.
   */
  station: string;
  verdict: 'accepted' | 'rejected';
  /**
   * Plain text, 2 000 bytes of UTF-8.
   */
  note?: string;
  by?: string | null;
  time?: string | null;
  kind: 'set_verdict';
}
/**
 * Clear a verdict.
 */
export interface ClearVerdict {
  /**
   * Id of a station.
   */
  station: string;
  kind: 'clear_verdict';
}
/**
 * Mark a station as done or skipped on site; state null: neither. By and time null: whoever marks it, now.
 */
export interface SetProgress {
  /**
   * Id of a station.
   */
  station: string;
  state: ('done' | 'skipped') | null;
  by?: string | null;
  time?: string | null;
  kind: 'set_progress';
}
/**
 * Sign the plan off as it stands; `earlier` restores a sign-off that was withdrawn.
 */
export interface Sign {
  /**
   * Plain text, 2 000 bytes of UTF-8.
   */
  note?: string;
  earlier?: SignOff | null;
  kind: 'sign';
}
/**
 * Who signed off the plan, as reviewed; a later revision of the review changed something since.
 *
 * The SHA-256 is that of plan.json.
 */
export interface SignOff {
  name: string;
  /**
   * UTC.
   */
  time: string;
  plan_sha256: string;
  revision: number;
  /**
   * Plain text, 2 000 bytes of UTF-8.
   */
  note?: string;
}
/**
 * Withdraw the sign-off.
 */
export interface Unsign {
  kind: 'unsign';
}
/**
 * The head of a part of a cloud. rows x columns uint16 ranges follow, then uint8 intensities.
 *
 * They are those of viewer/clouds once these are unpacked, the angles those of the stage's stations: see
 * docs/formats/stage.md.
 */
export interface CloudHead {
  rows: number;
  columns: number;
  range_step_m: number;
  /**
   * One a row.
   */
  elevations_rad: number[];
  /**
   * Of each row's first beam.
   */
  azimuths_rad: number[];
  azimuth_step_rad: number;
  /**
   * That the scanner sends into the window; rows x columns of them are here.
   */
  beams: number;
}
/**
 * A remark, pinned to a station, an element, a position or nothing.
 */
export interface Comment {
  id: string;
  /**
   * Plain text, 10 000 bytes of UTF-8.
   */
  text: string;
  author: string;
  /**
   * UTC.
   */
  time: string;
  /**
   * A station's id, an element's index in the scene, or null: the plan.
   */
  target?: string | number | null;
  position_m?: [number, number, number] | null;
  resolved?: boolean;
  /**
   * Who is to deal with it; empty: nobody.
   */
  assignee?: string;
  /**
   * The day by which, 2026-12-01; empty: none.
   */
  due?: string;
  /**
   * SHA-256 of a photo; empty: none.
   */
  photo?: string;
}
/**
 * What was kept. undo : changes that take it back, in the order to send them.
 */
export interface CommittedDocument {
  revision: number;
  undo: (
    | MoveStation
    | SetHeight
    | AddStation
    | RemoveStation
    | RestoreStation
    | LockStation
    | UnlockStation
    | Forbid
    | Allow
    | AddZone
    | ChangeZone
    | RemoveZone
    | PickGround
    | UnpickGround
    | AddEntrance
    | RemoveEntrance
    | SetDoor
    | AddComment
    | AssignComment
    | EditComment
    | ResolveComment
    | RemoveComment
    | SetVerdict
    | ClearVerdict
    | SetProgress
    | Sign
    | Unsign
  )[];
  review: Review;
}
/**
 * Everything that reviewers changed, by id.
 */
export interface Review {
  /**
   * How often something was changed; 0: never.
   */
  revision?: number;
  stations?: {
    [k: string]: StationEdit;
  };
  forbidden?: {
    [k: string]: ForbiddenPlace;
  };
  zones?: {
    [k: string]: Zone;
  };
  ground_picks?: {
    [k: string]: GroundPick;
  };
  entrances?: {
    [k: string]: Entrance;
  };
  /**
   * Doors that are open or shut whatever the plan has, by the source's id of the element.
   */
  doors?: {
    [k: string]: 'open' | 'shut';
  };
  comments?: {
    [k: string]: Comment;
  };
  verdicts?: {
    [k: string]: Verdict;
  };
  progress?: {
    [k: string]: StationProgress;
  };
  sign_off?: SignOff | null;
  /**
   * Last change of every object, also of removed ones: `station:S001`, `zone:Z001`, `forbidden:P001`, `pick:G001`, `entrance:E001`, `door:GLOBALID`, `comment:C001`, `verdict:S001`, `progress:S001`, `sign_off`.
   */
  touched?: {
    [k: string]: LastChange;
  };
}
/**
 * What was changed of a station; null: as in the plan, which has no such station where it was `added`.
 *
 * With a position, that of the sensor, height and floor go with it.
 */
export interface StationEdit {
  position_m?: [number, number, number] | null;
  instrument_height_m?: number | null;
  floor?: string | null;
  added?: boolean;
  removed?: boolean;
  locked?: boolean | null;
}
/**
 * What a reviewer thinks of a station.
 */
export interface Verdict {
  verdict: 'accepted' | 'rejected';
  by: string;
  /**
   * UTC.
   */
  time: string;
  /**
   * Plain text, 2 000 bytes of UTF-8.
   */
  note?: string;
}
/**
 * How far the crew came with a station: scanned, or skipped.
 */
export interface StationProgress {
  state: 'done' | 'skipped';
  by: string;
  /**
   * UTC.
   */
  time: string;
}
/**
 * When an object was last changed, and by whom.
 */
export interface LastChange {
  /**
   * The revision that the change made.
   */
  revision: number;
  by: string;
  /**
   * UTC.
   */
  at: string;
}
/**
 * Nothing was changed, because someone else changed it first; `review` is as it stands.
 */
export interface ConflictDocument {
  message: string;
  conflicts: EditConflict[];
  review: Review;
}
/**
 * An object that someone else changed meanwhile.
 */
export interface EditConflict {
  /**
   * As in `touched` of a review.
   */
  object: string;
  /**
   * Who changed it last.
   */
  by: string;
  /**
   * When, UTC.
   */
  at: string;
}
/**
 * The whole drawing as corrected.
 */
export interface Correction {
  /**
   * The revision that it was made from.
   */
  base_revision: number;
  drawing: DrawnBuilding;
}
/**
 * A building as drawings show it, and as people corrected it.
 */
export interface DrawnBuilding {
  schema?: 'tlsplan:drawing:1';
  /**
   * 0: as recognised. Each correction that is saved counts one.
   */
  revision?: number;
  /**
   * Of the building in the IFC file.
   */
  name: string;
  files: DrawnFile[];
  /**
   * What doubtful passages and stairs count as.
   */
  doubtful?: 'as-open' | 'as-wall';
  door_height_m: number;
  /**
   * Of windows, above the floor.
   */
  sill_height_m: number;
  window_head_m: number;
  /**
   * Thickness of the lowest and the highest slab; others reach from a ceiling to the next floor.
   */
  slab_m: number;
  /**
   * Direction of north in the plan, clockwise from +y; null: not known.
   */
  north_deg?: number | null;
  /**
   * By which everything was enlarged since it was recognised; the lines of the drawing are, too.
   */
  scale?: number;
  /**
   * The lowest first.
   */
  storeys: DrawnStorey[];
}
/**
 * A drawing that the building was recognised in.
 */
export interface DrawnFile {
  name: string;
  sha256: string;
}
/**
 * One storey.
 */
export interface DrawnStorey {
  name: string;
  /**
   * Of its floor.
   */
  elevation_m: number;
  /**
   * From floor to ceiling: the height of its walls.
   */
  room_height_m: number;
  /**
   * Recognised without named layers, as in pictures: walls and openings that miss each other by 12 cm close.
   */
  traced: boolean;
  walls: DrawnWall[];
  openings: DrawnOpening[];
  texts?: DrawnText[];
  stairs?: DrawnStair[];
}
/**
 * A wall, or a piece of one.
 */
export interface DrawnWall {
  /**
   * Of one wall in its storey.
   */
  id: string;
  /**
   * Corners (x, y) of a simple polygon, without repeating the first.
   */
  outline: [number, number][];
  holes?: [number, number][][];
}
/**
 * A door, a window, or a passage without either.
 */
export interface DrawnOpening {
  /**
   * Of one opening in its storey.
   */
  id: string;
  kind: 'door' | 'window' | 'passage';
  /**
   * From a jamb along the opening: 0-1 and 2-3 lie in the wall's faces, 1-2 and 3-0 are the jambs.
   *
   * @minItems 4
   * @maxItems 4
   */
  corners: [[number, number], [number, number], [number, number], [number, number]];
  name?: string;
  /**
   * Nothing in the drawing shows what it is; of passages.
   */
  doubtful?: boolean;
}
/**
 * A text, by which the room around it has its name.
 */
export interface DrawnText {
  text: string;
  /**
   * Middle of its box.
   *
   * @minItems 2
   * @maxItems 2
   */
  at: [number, number];
}
/**
 * The treads of a flight as this storey shows them.
 */
export interface DrawnStair {
  /**
   * A corner; treads lie along `along`, and across to its left.
   *
   * @minItems 2
   * @maxItems 2
   */
  foot: [number, number];
  /**
   * Unit vector.
   *
   * @minItems 2
   * @maxItems 2
   */
  along: [number, number];
  run_m: number;
  width_m: number;
}
/**
 * Coverage of surface.
 */
export interface CoverageFigures {
  /**
   * Seen by at least one admissible candidate or by a station of the plan.
   */
  achievable_area_m2: number;
  /**
   * All surface of the model that counts here, the inside of walls included.
   */
  total_area_m2: number;
  /**
   * Seen by at least one station of the plan.
   */
  covered_area_m2: number;
  /**
   * covered / scannable.
   */
  fraction_of_achievable: number;
  /**
   * covered / total.
   */
  fraction_of_total: number;
}
/**
 * The drawing of the plan.
 */
export interface DrawingDocument {
  /**
   * Null: the plan was made from a model.
   */
  drawing: DrawnBuilding | null;
  /**
   * Of each storey.
   */
  rooms: DrawnRoom[][];
  /**
   * Whether this page may save corrections.
   */
  may_correct: boolean;
  /**
   * Name of the drawing file, which `tlsplan plan` plans.
   */
  file: string;
  /**
   * Whether there is a plan of it already.
   */
  has_plan: boolean;
}
/**
 * A room, as walls and openings enclose it.
 */
export interface DrawnRoom {
  name: string;
  long_name: string;
  /**
   * Corners x, y, plan coordinates, metres.
   */
  outline: [number, number][];
}
/**
 * All that is drawn of a storey.
 */
export interface DrawnLinesDocument {
  /**
   * Of each line x, y of its corners in turn, millimetres: the first, then steps; as recognised.
   */
  lines: number[][];
  /**
   * x0, y0, x1, y1 of the storey's picture, metres, as recognised; null: there is none.
   */
  picture: [number, number, number, number] | null;
}
/**
 * What can be had of the plan, stations as reviewed.
 */
export interface ExportList {
  exports: OfferedExport[];
  /**
   * Stations that were moved, added or taken out.
   */
  edited_stations: number;
}
/**
 * A format that the plan can be had in.
 */
export interface OfferedExport {
  /**
   * As `tlsplan export --format` takes it.
   */
  name: string;
  title: string;
  file_name: string;
  /**
   * Why it can't be made now; null: nothing is known of.
   */
  obstacle: string | null;
}
/**
 * Figures of the draft at a revision of the review; `stations`, `requirements`, `registration` as in plan.json.
 */
export interface FiguresOfDraft {
  revision: number;
  coverage: CoverageFigures;
  floors: FloorCoverage[];
  requirements: ResultSection[];
  stations: StationSection[];
  registration: RegistrationSection;
  /**
   * Fraction of achievable after 1, 2, ... stations, the steepest first.
   */
  curve: number[];
  /**
   * In the order of the curve.
   */
  curve_stations: string[];
  /**
   * Largest first.
   */
  unseen: LeftSurfaceSection[];
}
/**
 * Surface of one element, in one room, that is not covered.
 */
export interface LeftSurfaceSection {
  /**
   * Number of the element in the scene.
   */
  element: number;
  name: string;
  kind: string;
  source_id: string;
  /**
   * null where it is in no room, or the source names none.
   */
  room: RoomSection | null;
  /**
   * Id of a floor; empty: of none.
   */
  floor: string;
  area_m2: number;
  /**
   * Connected pieces it is in.
   */
  n_pieces: number;
  /**
   * The largest, largest first.
   */
  pieces: PieceSection[];
}
/**
 * The head of a map of the ground. width x height uint8 follow, row by row from the lowest y: 0 nothing to walk on,
 * 1 walkable, but no tripod can stand, 2 one can, 3 kept free by the review.
 */
export interface GroundHead {
  floor: string;
  /**
   * [x, y], low corner of the first cell.
   */
  origin: number[];
  cell_m: number;
  width: number;
  height: number;
}
/**
 * How all stations are connected.
 */
export interface Joined {
  connected: boolean;
  n_networks: number;
}
/**
 * How far the live side is: it answers what moved stations are worth, once the scene is loaded.
 */
export interface LiveDocument {
  state: 'starting' | 'ready' | 'failed' | 'off';
  /**
   * What it does while it starts.
   */
  step: string | null;
  /**
   * Of the start, 0 to 1, as far as it is known.
   */
  fraction: number | null;
  /**
   * Why it failed or is off, and what helps.
   */
  message: string | null;
}
/**
 * A photo that was kept.
 */
export interface PhotoDocument {
  /**
   * What a comment names it by.
   */
  sha256: string;
}
/**
 * The head of a preview. Three arrays follow, an entry a patch that differs from the draft: uint32 patches, rising;
 * uint16 values of the layer; uint8 times seen, 255 where no candidate can.
 */
export interface PreviewHead {
  sequence: number;
  revision: number;
  n_patches_changed: number;
  /**
   * Where the station would stand, the sensor's origin.
   *
   * @minItems 3
   * @maxItems 3
   */
  position: [number, number, number];
  instrument_height_m: number;
  /**
   * Whether it is a valid tripod position.
   */
  admissible: boolean;
  /**
   * Why it is not the requested position, or not valid; empty where it is.
   */
  reason: string;
  coverage: CoverageFigures;
  floors: FloorCoverage[];
  requirements: RequirementFigure[];
  station: StationAreas;
  /**
   * Of the station.
   */
  links: Link[];
  n_stations: number;
  registration: Joined;
}
/**
 * How far a requirement is met.
 */
export interface RequirementFigure {
  name: string;
  required: number;
  fraction_of_achievable: number;
  met: boolean;
}
/**
 * What a station covers, and what it alone covers.
 */
export interface StationAreas {
  covered_area_m2: number;
  own_area_m2: number;
}
/**
 * A station that is being dragged, raised, or about to be added.
 */
export interface PreviewQuestion {
  /**
   * Id of the station; null: a new one.
   */
  station: string | null;
  /**
   * Id of its floor.
   */
  floor: string;
  /**
   * [x, y] or [x, y, z]; z, the sensor's, distinguishes grounds above each other.
   */
  position: number[];
  instrument_height_m: number;
  /**
   * `times_seen` or a layer of the plan.
   */
  layer?: string;
  /**
   * Grows with every question of a page.
   */
  sequence?: number;
  /**
   * Names the page. Where given, questions that a newer one of it has overtaken are not answered.
   */
  client?: string;
}
/**
 * Why something was not done, in words for people.
 */
export interface Refusal {
  message: string;
}
/**
 * The route through the draft's stations, `route` and `field_time` as in plan.json.
 */
export interface RouteOfDraft {
  revision: number;
  route: RouteSection | null;
  field_time: FieldTimeSection | null;
}
/**
 * The best stations so far; of a run that has a plan, those of the plan.
 */
export interface RunBest {
  n_stations: number;
  /**
   * Lower bound of the number of stations; null: unknown.
   */
  lower_bound?: number | null;
  /**
   * Covered; null: not counted yet.
   */
  fraction_of_achievable?: number | null;
  /**
   * Scene frame, metres; empty: not known yet.
   */
  stations?: [number, number, number][];
}
/**
 * A run, as it stands.
 */
export interface RunDocument {
  id: string;
  title: string;
  /**
   * A cancelled run has a plan where it was cancelled late enough to have one.
   */
  state: 'running' | 'finished' | 'cancelled' | 'failed';
  /**
   * It is cancelled, and still goes on.
   */
  cancelling?: boolean;
  /**
   * UTC.
   */
  created: string;
  ended?: string | null;
  /**
   * What it is doing.
   */
  stage?: string | null;
  /**
   * Steps of `total`, of this stage.
   */
  done?: number | null;
  /**
   * 0: not known.
   */
  total?: number | null;
  /**
   * A remark on the stage, for people.
   */
  note?: string | null;
  best?: RunBest | null;
  /**
   * Why it failed, or how it ended; what helps.
   */
  message?: string | null;
  /**
   * Of the finished plan.
   */
  warnings?: string[];
  /**
   * Its plan folder, below /plan/ of this server.
   */
  plan?: string | null;
  request: RunRequest;
  /**
   * The run whose best stations it began with.
   */
  resumed_from?: string | null;
  /**
   * Of the plan.json that it was requested on.
   */
  plan_sha256: string;
  /**
   * Of the review then.
   */
  revision: number;
}
/**
 * What a new plan is to meet.
 */
export interface RunRequest {
  /**
   * One line for people.
   */
  title?: string;
  /**
   * Entries of a requirements file, docs/formats/requirements.md. Limits (spacing, range, incidence, noise), seen_from and planned_floors that are left out are not required; anything else that is left out, parts of the building and the site too, stays as in the plan.
   */
  requirements?: {
    [k: string]: unknown;
  };
  /**
   * As --objective.
   */
  objective?: 'fewest' | 'coverage' | 'time';
  /**
   * With objective coverage, and only there.
   */
  max_stations?: number | null;
  /**
   * Whether the review counts: its stations are kept where that costs nothing, or locked; zones, forbidden places, ground, entrances and doors are taken over. Other objectives than fewest keep no stations.
   */
  from_review?: boolean;
  /**
   * Whether the corrected drawing beside the plan counts: it is raised to an IFC file anew, which takes the place of the one that was planned.
   */
  from_drawing?: boolean;
  /**
   * Of the search; the best plan until then is taken.
   */
  time_limit_s?: number | null;
}
/**
 * All runs of the plan folder, the oldest first.
 */
export interface RunList {
  runs: RunDocument[];
  /**
   * Why no run can be started, as where the scene is missing.
   */
  obstacle: string | null;
}
/**
 * What a page needs to know first.
 */
export interface SessionDocument {
  schema: 'tlsplan/api/1';
  /**
   * Of plan.json: another one is another plan.
   */
  plan_sha256: string;
  revision: number;
  read_only: boolean;
  /**
   * The token of this page is for comments and verdicts only.
   */
  comment_only: boolean;
  live: LiveDocument;
}
