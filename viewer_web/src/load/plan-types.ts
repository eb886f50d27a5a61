/** plan.json. Generated of docs/formats/plan.schema.json by `npm run types`: change its model instead. */

export interface Documents {
  BestPositionSection: BestPositionSection;
  CheckedFigure: CheckedFigure;
  CheckedLink: CheckedLink;
  CoverageSection: CoverageSection;
  FieldTimeSection: FieldTimeSection;
  FloorCoverage: FloorCoverage;
  FloorSection: FloorSection;
  GapSection: GapSection;
  Georeference: Georeference;
  IndependentCheck: IndependentCheck;
  KeepOut: KeepOut;
  LeftOutSection: LeftOutSection;
  LegSection: LegSection;
  Link: Link;
  LoadOptions: LoadOptions;
  LossSection: LossSection;
  NetworkJoin: NetworkJoin;
  NetworkSection: NetworkSection;
  ObstacleSection: ObstacleSection;
  OptimalitySection: OptimalitySection;
  OwnPartSection: OwnPartSection;
  PartRequirement: PartRequirement;
  PickSection: PickSection;
  PieceSection: PieceSection;
  PlannedParameters: PlannedParameters;
  PlannedRequirements: PlannedRequirements;
  PointLimits: PointLimits;
  PriorStation: PriorStation;
  RegistrationSection: RegistrationSection;
  Repairs: Repairs;
  ResultSection: ResultSection;
  RoomSection: RoomSection;
  RouteSection: RouteSection;
  Scanner: Scanner;
  SceneFileSection: SceneFileSection;
  SceneSection: SceneSection;
  ScopeSection: ScopeSection;
  Site: Site;
  SourceSection: SourceSection;
  StationReasonSection: StationReasonSection;
  StationSection: StationSection;
  StepSection: StepSection;
  UnreachableSection: UnreachableSection;
  UnseenSection: UnseenSection;
  UnseenSurfaceSection: UnseenSurfaceSection;
  WeakMotion: WeakMotion;
  WhySection: WhySection;
  PlanDocument: PlanDocument;
}
/**
 * The candidate that sees most of a surface.
 */
export interface BestPositionSection {
  /**
   * The sensor's origin.
   *
   * @minItems 3
   * @maxItems 3
   */
  position: [number, number, number];
  /**
   * Of this surface.
   */
  sees_m2: number;
  /**
   * Of all that is not worth a station.
   */
  adds_m2: number;
}
/**
 * A figure of a plan beside what random points say.
 */
export interface CheckedFigure {
  /**
   * Of the plan.
   */
  told: number;
  /**
   * Of the points.
   */
  judged: number;
  /**
   * One standard error of it.
   */
  error: number;
}
/**
 * Overlap of two stations by random points, as fractions, measured as the plan's requirements say.
 */
export interface CheckedLink {
  a: string;
  b: string;
  overlap: CheckedFigure;
}
/**
 * Coverage, overall and floor by floor.
 */
export interface CoverageSection {
  /**
   * Coverage is counted on patches no larger than this.
   */
  max_patch_area_m2: number;
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
  /**
   * In the order of `floors`.
   */
  floors: FloorCoverage[];
}
/**
 * Coverage of a floor.
 */
export interface FloorCoverage {
  /**
   * Id of a floor.
   */
  floor: string;
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
 * Seconds in the field.
 */
export interface FieldTimeSection {
  /**
   * null where the duration of a scan is not known.
   */
  scanning_s: number | null;
  /**
   * Of all stations.
   */
  set_up_s: number;
  /**
   * Along the legs that can be walked.
   */
  walking_s: number;
  /**
   * The sum; null where a part is not known.
   */
  total_s: number | null;
}
/**
 * A floor.
 */
export interface FloorSection {
  /**
   * F0 is the lowest that was found; floors that people marked have the numbers behind those found.
   */
  id: string;
  name: string;
  /**
   * Height of the ground.
   */
  elevation_m: number;
  ground_area_m2: number | null;
  /**
   * [[x_min, y_min], [x_max, y_max]] of the ground.
   *
   * @minItems 2
   * @maxItems 2
   */
  bounds: [[number, number], [number, number]];
  /**
   * How the ground was found.
   */
  origin: 'slab' | 'surface' | 'storey-elevation' | 'wall-foot' | 'marked';
  n_stations: number;
}
/**
 * Two networks, by their places in the list, and the link between them that comes nearest to counting.
 */
export interface GapSection {
  networks: number[];
  best: Link;
  /**
   * Places for three targets that both stations of the link see, to register the networks by; empty: none found.
   */
  targets: [number, number, number][];
}
/**
 * Overlap of two stations.
 */
export interface Link {
  a: string;
  b: string;
  /**
   * What both see, as a share, measured as `requirements.overlap_measure` and `overlap_of` say.
   */
  overlap: number;
  /**
   * Smallest eigenvalue of the shared surface's point-to-plane normal matrix, scaled to [0, 1]: how well the surface
   * holds the two together in its weakest direction. NaN, in documents null, where not computed.
   */
  strength: number | null;
  /**
   * The motion that the shared surface holds least; null where not computed, and in plans of older versions.
   */
  weak_motion: WeakMotion | null;
  /**
   * It counts below what is required: both stations are scanned and need no margin for setting up.
   */
  as_set_up: boolean;
  /**
   * That the two scans register, from `registration.pre_alignment`; NaN, in documents null, where not computed.
   */
  probability: number | null;
  /**
   * Ids (GlobalId) of open doors that it needs open during both scans: where one is shut it does not count.
   */
  only_open: string[];
  /**
   * Of a pair that does not count: ids of open doors; it counts where these are shut during both scans.
   */
  only_shut: string[];
  /**
   * Places for three targets that both stations see and that register them: it counts, whatever they have in common.
   * Local frame; in documents the scene's.
   */
  targets: [number, number, number][];
  /**
   * The weak motion in words by axes of the scene; empty where not computed.
   */
  weak_axis: string;
}
/**
 * The small motion of one scan against another that the surface they share holds least.
 */
export interface WeakMotion {
  kind: 'shift' | 'turn';
  /**
   * Unit vector in axes of the scene, along the shift or about the turn; either of its two senses.
   *
   * @minItems 3
   * @maxItems 3
   */
  direction: [number, number, number];
}
/**
 * Where on earth the scene is by its file, unchecked; texts as the file has them, empty: not given.
 */
export interface Georeference {
  /**
   * `IfcMapConversion`, `IfcMapConversionScaled`, `IfcRigidOperation` or `ePset_MapConversion`; empty: none.
   */
  operation: string;
  /**
   * Rows of the matrix from scene positions to easting, northing and height, metres to metres; null: no map
   * conversion.
   */
  to_map:
    | [
        [number, number, number, number],
        [number, number, number, number],
        [number, number, number, number],
        [number, number, number, number],
      ]
    | null;
  /**
   * Name of the coordinate reference system, mostly `EPSG:25832`.
   */
  crs_name: string;
  /**
   * The same as WKT; empty in most files.
   */
  crs_text: string;
  /**
   * Of the coordinate reference system.
   */
  description: string;
  geodetic_datum: string;
  vertical_datum: string;
  map_projection: string;
  map_zone: string;
  map_unit: string;
  /**
   * Of the site; north is positive.
   */
  site_latitude_deg: number | null;
  /**
   * Of the site; east is positive.
   */
  site_longitude_deg: number | null;
  /**
   * Of the site.
   */
  site_elevation_m: number | null;
  /**
   * Scene position that latitude, longitude and elevation are of.
   */
  site_position: [number, number, number] | null;
  /**
   * Direction in the plan of the scene, of length 1; null: not given.
   */
  true_north: [number, number] | null;
  /**
   * What is odd about it, one line each, for the user.
   */
  warnings: string[];
}
/**
 * Figures by random points, each checked by itself with rays of Open3D, of all requirements together.
 */
export interface IndependentCheck {
  n_points: number;
  engine: string;
  covered_m2: CheckedFigure;
  achievable_m2: CheckedFigure1;
  share: CheckedFigure2;
  links: CheckedLink[];
}
/**
 * A figure of a plan beside what random points say.
 */
export interface CheckedFigure1 {
  /**
   * Of the plan.
   */
  told: number;
  /**
   * Of the points.
   */
  judged: number;
  /**
   * One standard error of it.
   */
  error: number;
}
/**
 * A figure of a plan beside what random points say.
 */
export interface CheckedFigure2 {
  /**
   * Of the plan.
   */
  told: number;
  /**
   * Of the points.
   */
  judged: number;
  /**
   * One standard error of it.
   */
  error: number;
}
/**
 * An area where nobody goes, or, with `access`, the only one on its floor where somebody does.
 */
export interface KeepOut {
  /**
   * Corners (x, y) of a simple polygon, scene coordinates.
   */
  outline: [number, number][];
  /**
   * Id or name; empty: all floors.
   */
  floor: string;
  access: boolean;
  name: string;
}
/**
 * Elements that were left out of the scene.
 */
export interface LeftOutSection {
  /**
   * Class or pattern, as given.
   */
  name: string;
  area_m2: number;
}
/**
 * The way between two stops.
 */
export interface LegSection {
  /**
   * Id of a station; null: the start.
   */
  from: string | null;
  /**
   * Id of a station; null: the end, or the start of a route that returns.
   */
  to: string | null;
  /**
   * null where it can't be walked.
   */
  length_m: number | null;
  /**
   * Ids of the floors passed, in their order.
   */
  floors: string[];
  /**
   * Corners of the way, on the ground; empty where it can't be walked.
   */
  points: [number, number, number][];
}
/**
 * How a file is read. null: the file's own; where it has none, metres and z up.
 */
export interface LoadOptions {
  metres_per_unit: number | null;
  up_axis: ('Y' | 'Z') | null;
  /**
   * Drop faces that name a vertex which does not exist, instead of refusing the file.
   */
  skip_bad_faces: boolean;
  /**
   * What glass does to beams.
   */
  glass: 'pass' | 'stop' | 'return';
  /**
   * Which doors (`IfcDoor`) have their leaves left out.
   */
  doors: 'shut' | 'open' | 'all' | 'outside';
  /**
   * GlobalIds of doors that have their leaves left out whatever `doors` is.
   */
  doors_open: string[];
  /**
   * GlobalIds of doors that keep them whatever `doors` is.
   */
  doors_shut: string[];
  /**
   * Classes and patterns of names (`IfcFurnishingElement`, `name=*tree*`) whose elements are left out.
   */
  leave_out: string[];
}
/**
 * What a requirement would lose without a station.
 */
export interface LossSection {
  /**
   * Name of one of `requirements.results`.
   */
  requirement: string;
  /**
   * Of it, that no longer would be as required.
   */
  area_m2: number;
  /**
   * Of the requirement, without this station.
   */
  fraction_of_achievable: number;
  /**
   * Whether the requirement would be met without this station.
   */
  met: boolean;
}
/**
 * Stations that coverage does not need, linked with each other, and what they join.
 */
export interface NetworkJoin {
  stations: string[];
  /**
   * Groups of the other stations that they link; 1: they make their network hold as it is set up.
   */
  n_groups: number;
  /**
   * Ids of these groups' floors, in the order of the plan.
   */
  floors: string[];
}
/**
 * Stations that links join.
 */
export interface NetworkSection {
  stations: string[];
  floors: string[];
  n_links: number;
  /**
   * Links without which it falls apart.
   */
  bridges: [string, string][];
  /**
   * Stations without which the others fall apart.
   */
  articulations: string[];
  /**
   * Weakest link that some pair of stations relies on: the nearest to what is required.
   */
  bottleneck: Link | null;
  two_connected: boolean;
}
/**
 * Surface of which nothing is required: it hides what lies behind it, and counts nowhere.
 */
export interface ObstacleSection {
  /**
   * Of the part of `requirements.parts` that requires it.
   */
  name: string;
  /**
   * In scope.
   */
  area_m2: number;
}
/**
 * How good the plan is proven to be.
 */
export interface OptimalitySection {
  objective: string;
  stations: number;
  /**
   * No plan on these candidates (and given stations) that meets the required coverage has fewer stations; null where
   * no bound is known.
   */
  lower_bound: number | null;
  /**
   * (stations - lower_bound) / stations; null where no bound is known, or where coverage misses the requirement.
   */
  gap: number | null;
  /**
   * This plan meets the required coverage, and no plan on these candidates that does has fewer stations.
   */
  proven: boolean;
  /**
   * Why the search for fewer stations ended: proven, work limit, time limit, interrupted, earlier stations kept;
   * empty where the method does not search.
   */
  why_stopped: string;
  /**
   * Candidates that the lower bound holds for: grid, doorways, rooms, landings, given stations, in the connected
   * components that the plan is made in. Positions off the grid may do better than the bound.
   */
  n_candidates_bounded: number | null;
  /**
   * Stations that greedy selection takes for the same; null: not known.
   */
  greedy_stations: number | null;
  /**
   * Of another objective than fewest stations: seconds in the field, or fraction of the scannable area covered.
   */
  value: number | null;
  /**
   * What no plan on these candidates is better than, in the same unit.
   */
  bound: number | null;
}
/**
 * Surface of an element in a room that only one station sees.
 */
export interface OwnPartSection {
  /**
   * Number of the element in the scene.
   */
  element: number;
  name: string;
  /**
   * null where it is in no room, or the source names none.
   */
  room: RoomSection | null;
  area_m2: number;
}
/**
 * A room that the source names.
 */
export interface RoomSection {
  name: string;
  /**
   * IFC GlobalId.
   */
  source_id: string;
}
/**
 * Requirement of one part of the building. The part is what `floors`, `classes`, `zone` and `heights_m` all name.
 *
 * A part that is one whole floor takes the place of the general one for that floor; any other part is required
 * besides. A patch lies where its centroid lies.
 */
export interface PartRequirement {
  name: string;
  /**
   * Fraction of the part's area that is achievable by `limits` and `seen_from`; 0: of the part nothing is required,
   * also where other requirements are about it: it is an obstacle only.
   */
  coverage: number;
  asked: PointLimits;
  /**
   * Stations that must each meet the limits for a surface to count.
   */
  seen_from: number;
  /**
   * Ids or names; empty: all planned.
   */
  floors: string[];
  /**
   * Patterns (`*`, `?`) of element classes or names, such as `IfcWall*`; empty: all.
   */
  classes: string[];
  /**
   * Corners (x, y) of a polygon in plan, scene coordinates; empty: everywhere.
   */
  zone: [number, number][];
  /**
   * Lowest and highest z, scene coordinates; null: all.
   */
  heights: [number, number] | null;
}
/**
 * Limits on how surfaces are seen; null: none. All limits are included.
 */
export interface PointLimits {
  /**
   * Greatest distance between neighbouring points, LOD.
   */
  spacing_m: number | null;
  range_m: number | null;
  /**
   * Greatest angle between beam and surface normal.
   */
  incidence_rad: number | null;
  /**
   * Greatest one sigma of range noise, LOA.
   */
  noise_m: number | null;
}
/**
 * A surface marked as ground, or unmarked: the coplanar region around a point.
 */
export interface PickSection {
  /**
   * @minItems 3
   * @maxItems 3
   */
  point: [number, number, number];
  is_ground: boolean;
  /**
   * Id or name; empty: the nearest.
   */
  floor: string;
}
/**
 * Surface that is connected.
 */
export interface PieceSection {
  area_m2: number;
  /**
   * Centre of its area; of a bent piece it need not lie on it.
   *
   * @minItems 3
   * @maxItems 3
   */
  centroid: [number, number, number];
  /**
   * Lowest and highest corner.
   *
   * @minItems 2
   * @maxItems 2
   */
  box: [[number, number, number], [number, number, number]];
  /**
   * Number of the patch nearest to the centre.
   */
  patch: number;
}
/**
 * Everything else that decided the plan, and the size of the problem.
 */
export interface PlannedParameters {
  objective: 'fewest' | 'coverage' | 'time';
  grid_step_m: number;
  instrument_heights_m: number[];
  height_step_m: number;
  clearance_m: number;
  ground_ring_radius_m: number;
  n_ground_ring_rays: number;
  max_patch_area_m2: number;
  /**
   * What visibility was computed by: every beam, or samples of every patch.
   */
  scan_mode: 'beams' | 'patches';
  /**
   * Doorways, room centres and landings were candidates besides the grid.
   */
  special_places: boolean;
  /**
   * Better places off the grid were searched for.
   */
  refine: boolean;
  max_stations: number | null;
  seconds_per_scan: number | null;
  set_up_s: number;
  /**
   * Links hold wherever within this of its mark, and half of it in height, each station is set up.
   */
  set_up_tolerance_m: number;
  walking_m_per_s: number;
  n_candidates: number;
  n_patches: number;
}
/**
 * What was required, and what became of it.
 */
export interface PlannedRequirements {
  coverage: number;
  overlap: number;
  overlap_measure: 'smaller-share' | 'jaccard';
  overlap_of: 'all-seen' | 'seen-as-required';
  floors: string[];
  asked: PointLimits;
  /**
   * Stations that must each meet the limits for a surface to count.
   */
  seen_from: number;
  reflectivity: number;
  /**
   * How links that count must connect the stations, as far as candidates can be linked at all.
   */
  network: 'connected' | 'redundant' | 'none' | 'joined' | 'loops';
  /**
   * Least strength of a link that counts.
   */
  min_strength: number;
  /**
   * Least probability with which the scans of a link that counts register; 0: not required.
   */
  min_probability: number;
  pre_alignment: ('tracked' | 'manual' | 'level' | 'none') | null;
  doors_change: boolean;
  targets: boolean | null;
  scope: 'auto' | 'interior' | 'exterior' | 'all';
  deliverable: string | null;
  parts: PartRequirement[];
  /**
   * Of floors, overall, of parts.
   */
  results: ResultSection[];
}
/**
 * What became of one thing that was required: of a floor, overall, of a part.
 */
export interface ResultSection {
  name: string;
  required: number;
  /**
   * Stations that must each meet the limits for a surface to count.
   */
  seen_from: number;
  asked: PointLimits;
  achievable_area_m2: number;
  covered_area_m2: number;
  total_area_m2: number;
  fraction_of_achievable: number;
  met: boolean;
  /**
   * Fraction that 99 of 100 set-ups cover at least, each station anywhere within `settings.set_up_tolerance_m` of its
   * mark; left out where it was not computed.
   */
  as_set_up: number | null;
}
/**
 * A station, or a forbidden position, given before planning.
 */
export interface PriorStation {
  id: string;
  /**
   * The sensor's origin.
   *
   * @minItems 3
   * @maxItems 3
   */
  position: [number, number, number];
  role: 'scanned' | 'locked' | 'kept' | 'begun' | 'forbidden';
  floor: string;
  instrument_height_m: number | null;
  /**
   * Of a forbidden place.
   */
  radius_m: number | null;
}
/**
 * Links between stations, and what they join.
 */
export interface RegistrationSection {
  /**
   * Minimum overlap of a link; 0: not required.
   */
  threshold: number;
  /**
   * Strength from which on a link counts.
   */
  min_strength: number;
  /**
   * Probability to register from which on a link counts; 0: not required.
   */
  min_probability: number;
  /**
   * Where registration starts, of links' probabilities.
   */
  pre_alignment: 'tracked' | 'manual' | 'level' | 'none';
  /**
   * Links count with open doors shut, too.
   */
  doors_change: boolean;
  /**
   * Links that count join all stations.
   */
  connected: boolean;
  links: Link[];
  /**
   * Largest first.
   */
  networks: NetworkSection[];
  /**
   * Links that count, between stations of different floors.
   */
  floor_joins: [string, string][];
  gaps: GapSection[];
  /**
   * Ids of open doors without which there are more networks.
   */
  doors_needed: string[];
  /**
   * Stations that are there for the network alone, and what they join; plans of older versions have none.
   */
  joins: NetworkJoin[];
}
/**
 * Faces that were dropped on loading, by reason.
 */
export interface Repairs {
  faces_read: number;
  non_finite: number;
  degenerate: number;
  duplicate: number;
  bad_index: number;
  stray: number;
  /**
   * Up to 100 lines on faces that were dropped: element, face, reason.
   */
  dropped: string[];
  /**
   * What loading wants the user to know.
   */
  warnings: string[];
}
/**
 * The route through the stations.
 */
export interface RouteSection {
  /**
   * Along the legs that can be walked.
   */
  length_m: number;
  /**
   * Legs that no way inside the model leads along.
   */
  n_unwalkable: number;
  /**
   * The route ends where it begins.
   */
  returns: boolean;
  /**
   * No order of these stations, a storey at a time, makes a shorter route.
   */
  exact: boolean;
  /**
   * Where the route begins, on the ground; null: at the first station.
   */
  start: [number, number, number] | null;
  /**
   * Where it ends; null: at the last station, or where it begins.
   */
  end: [number, number, number] | null;
  /**
   * Ids of all stations in the order of visits; those left out last.
   */
  order: string[];
  /**
   * Ids of stations to which no way leads.
   */
  left_out: string[];
  /**
   * From stop to stop, in their order.
   */
  legs: LegSection[];
}
/**
 * A scanner's specification, in the instrument's own frame. Channels are the rows of a scan, azimuths its columns.
 *
 * Figures that are null are not known.
 */
export interface Scanner {
  name: string;
  /**
   * Which of its resolutions this is: a mode's id, or a point spacing at 10 m such as `6mm`; empty: it has one.
   */
  mode: string;
  title: string;
  /**
   * Where the figures are from.
   */
  source: string;
  range_min_m: number;
  range_max_m: number;
  n_azimuths: number;
  /**
   * One angle a channel, up from the horizontal, highest first.
   */
  elevation_rad: number[];
  /**
   * First and last of `n_azimuths` even azimuths of a sector, both included, counter-clockwise from +x; empty: a full
   * turn from 0.
   */
  azimuth_range_rad: number[];
  /**
   * One angle a channel, added to its azimuths; empty: none.
   */
  azimuth_offset_rad: number[];
  /**
   * Hangs upside down: turned by 180 degrees about its x axis.
   */
  inverted: boolean;
  instrument_height_min_m: number;
  instrument_height_max_m: number;
  /**
   * What a crew sets its tripod to; null: any height of the range is as good.
   */
  instrument_height_usual_m: number | null;
  /**
   * Of a whole scan in this mode.
   */
  seconds_per_scan: number | null;
  /**
   * Rows (range in metres, reflectivity in 0..1, one sigma in metres), by reflectivity, then range.
   */
  range_noise: [number, number, number][];
  /**
   * (a, b): a range r is accurate to a + b r metres, as the maker states it.
   */
  ranging_accuracy: [number, number] | null;
  /**
   * Of either angle, as the maker states it.
   */
  angular_accuracy_rad: number | null;
  /**
   * Full angle, by the definition of a beam's width that `beam_width_at` names.
   */
  beam_divergence_rad: number | null;
  /**
   * At the exit, by the same definition.
   */
  beam_diameter_m: number | null;
  /**
   * `1/e`, `1/e2`, `FWHM`, or empty: not given.
   */
  beam_width_at: string;
  wavelength_m: number | null;
  dual_axis_compensator: boolean | null;
  /**
   * How well a scan's pose is known before it is registered.
   */
  pre_alignment: 'tracked' | 'manual' | 'level' | 'none';
  /**
   * Number of rows of a scan.
   */
  n_channels: number;
}
/**
 * A file of a scene of several, as it was read.
 */
export interface SceneFileSection {
  /**
   * Its name, without its folder.
   */
  file: string;
  /**
   * Of its bytes, hexadecimal.
   */
  sha256: string;
  format: 'ifc' | 'obj' | 'ply' | 'stl' | 'gltf' | 'usd' | 'memory';
  /**
   * As stated in it; empty where it states nothing.
   */
  schema: string;
  units: string;
  metres_per_unit: number;
  up_axis: 'Y' | 'Z';
  load_options: LoadOptions;
}
/**
 * The scene as it was read.
 */
export interface SceneSection {
  /**
   * Name of the scene file, without its folder; of several the first.
   */
  file: string;
  /**
   * Of the file's bytes, hexadecimal; empty for a scene from memory.
   */
  sha256: string;
  /**
   * What was read.
   */
  format: 'ifc' | 'obj' | 'ply' | 'stl' | 'gltf' | 'usd' | 'memory';
  /**
   * As stated in the file: IFC2X3, glTF 2.0 ...; empty where it states nothing.
   */
  schema: string;
  /**
   * Unit of the file: metre, millimetre, inch ...
   */
  units: string;
  metres_per_unit: number;
  up_axis: 'Y' | 'Z';
  /**
   * What glass was taken to do to beams.
   */
  glass: 'pass' | 'stop' | 'return';
  /**
   * Which doors were taken to be open: none, those indoors, or those that lead outdoors, too; `outside`: all, and
   * stations may stand outdoors.
   */
  doors: 'shut' | 'open' | 'all' | 'outside';
  load_options: LoadOptions | null;
  /**
   * The files after the first, where the scene is several; entries above of a file are of the first.
   */
  other_files: SceneFileSection[];
  /**
   * Doors whose leaves were left out.
   */
  n_doors_open: number;
  /**
   * Scene position = local position + offset; the USD stage is local.
   *
   * @minItems 3
   * @maxItems 3
   */
  offset: [number, number, number];
  /**
   * Where on earth the scene is by its file, unchecked; null: not stated.
   */
  georeference: Georeference | null;
  n_elements: number;
  n_triangles: number;
  /**
   * Faces of clear glass by the file, both of a pane; `glass` is what they were taken to do.
   */
  glass_area_m2: number;
  mirror_area_m2: number;
  /**
   * Triangles that let beams pass: glass.
   */
  n_triangles_passing: number;
  /**
   * Triangles that end beams without a return: mirrors, and glass where the user chose so.
   */
  n_triangles_stopping: number;
  repairs: Repairs;
}
/**
 * What the figures are about.
 */
export interface ScopeSection {
  /**
   * What was planned; `auto` of the requirements is interior where the building has an inside, else all.
   */
  kind: 'interior' | 'exterior' | 'all';
  /**
   * Obstacles among it.
   */
  in_scope_area_m2: number;
  out_of_scope_area_m2: number;
  obstacles: ObstacleSection[];
  left_out: LeftOutSection[];
}
/**
 * Where the crew may go, and stations given before planning.
 */
export interface Site {
  /**
   * Places on the ground; empty: each floor's largest spaces have one.
   */
  entrances: [number, number, number][];
  keep_out: KeepOut[];
  settled: PriorStation[];
  /**
   * Of who carries the scanner; null, as of the next two: of a person.
   */
  mover_radius_m: number | null;
  step_m: number | null;
  mover_height_m: number | null;
  opens_doors: boolean;
  /**
   * Where the route of the day begins; null: at the first entrance, else where it is shortest.
   */
  start: [number, number, number] | null;
  end: [number, number, number] | null;
  /**
   * The route ends where it began.
   */
  returns: boolean;
  /**
   * In the order they were made: a later one has the last word.
   */
  ground_picks: PickSection[];
}
/**
 * Where the scene files were, seen from the plan folder. May differ between equal plans.
 */
export interface SourceSection {
  /**
   * Relative to the plan folder, with forward slashes; of several files the first.
   */
  path: string;
  /**
   * The same of `scene.other_files`, in their order.
   */
  other_paths: string[];
}
/**
 * What only this station sees.
 */
export interface StationReasonSection {
  station: string;
  /**
   * What would no longer be covered without it.
   */
  own_area_m2: number;
  /**
   * The largest parts of that, largest first.
   */
  own_parts: OwnPartSection[];
  /**
   * Stations it has links to that count for registration.
   */
  linked: string[];
}
/**
 * A station.
 */
export interface StationSection {
  id: string;
  /**
   * Id of a floor; empty: of none.
   */
  floor: string;
  /**
   * Order to visit.
   */
  order: number;
  /**
   * The sensor's origin.
   *
   * @minItems 3
   * @maxItems 3
   */
  position: [number, number, number];
  /**
   * Sensor above the ground below it; null where that is unknown.
   */
  instrument_height_m: number | null;
  /**
   * Given by the user, not chosen.
   */
  fixed: boolean;
  /**
   * Seen from here, as well as is required of all; floors that are not required count too.
   */
  covered_area_m2: number;
  /**
   * What is required and would no longer be covered without this station; of floors not required, nothing.
   */
  own_area_m2: number;
  /**
   * Achievable surface on which some requirement would no longer be met without it; null: not worked out.
   */
  lost_area_m2: number | null;
  /**
   * By requirement, of those that would lose something.
   */
  losses: LossSection[] | null;
}
/**
 * Coverage after one station more.
 */
export interface StepSection {
  station: string;
  covered_area_m2: number;
  fraction_of_achievable: number | null;
}
/**
 * A room that no entrance leads to; nothing is planned in it.
 */
export interface UnreachableSection {
  /**
   * Id of a floor; empty: of none.
   */
  floor: string;
  /**
   * Ground that a person could stand on.
   */
  area_m2: number;
  /**
   * A place in it, on the ground.
   *
   * @minItems 3
   * @maxItems 3
   */
  inside: [number, number, number];
  /**
   * Its ground in plan: no two share more than an edge. Plans of older versions have none.
   */
  rectangles: [[number, number], [number, number]][];
}
/**
 * Achievable surface of an element that the plan leaves unseen.
 */
export interface UnseenSection {
  /**
   * Number of the element in the scene.
   */
  element: number;
  /**
   * With its file in brackets, where the scene is several files.
   */
  name: string;
  kind: string;
  /**
   * What finds it in the source: IFC GlobalId, prim path ...
   */
  source_id: string;
  /**
   * Id of a floor; empty: of none.
   */
  floor: string;
  unseen_area_m2: number;
  achievable_area_m2: number;
}
/**
 * The same, and why.
 */
export interface UnseenSurfaceSection {
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
  /**
   * docs/method/unseen.md defines the reasons.
   */
  reason: string;
  area_m2: number;
  /**
   * Connected pieces it is in.
   */
  n_pieces: number;
  /**
   * The largest, largest first.
   */
  pieces: PieceSection[];
  /**
   * null unless the reason is `not worth a station`.
   */
  best_spot: BestPositionSection | null;
}
/**
 * What each station adds, and why the unseen stays unseen: docs/method/unseen.md.
 */
export interface WhySection {
  /**
   * One per station, in the order of `stations`.
   */
  stations: StationReasonSection[];
  /**
   * Coverage after 1, 2, ... stations, always taking the one that adds most.
   */
  curve: StepSection[];
  /**
   * Of all that is in scope, each patch counted once; covered comes first.
   */
  area_by_reason_m2: {
    [k: string]: number;
  };
  /**
   * Of surface that `unseen_surfaces` leaves out: slivers, and what is inside solids.
   */
  unlisted_area_m2: {
    [k: string]: number;
  };
  /**
   * By element, room, floor and reason, largest first.
   */
  unseen_surfaces: UnseenSurfaceSection[];
}
/**
 * plan.json of tlsplan, schema tlsplan/plan/1. Lengths are metres, areas square metres, shares lie in [0, 1].
 * Positions and elevations are in the scene frame: metres, z up, the source's own origin. A number that is unknown is
 * null. Keys are never removed or given another meaning under this schema; new ones may come, so readers ignore keys
 * they do not know. Keys with a default may be missing, as in plans of older versions.
 */
export interface PlanDocument {
  /**
   * Name and number of this contract.
   */
  schema: 'tlsplan/plan/1';
  scene: SceneSection;
  /**
   * null for scenes from memory.
   */
  source: SourceSection | null;
  scanner: Scanner;
  requirements: PlannedRequirements;
  method: string;
  /**
   * Options of the method that the user set, by name.
   */
  method_options: {
    [k: string]: string;
  };
  seed: number;
  settings: PlannedParameters;
  site: Site;
  /**
   * Lowest first.
   */
  floors: FloorSection[];
  /**
   * In the order to visit.
   */
  stations: StationSection[];
  /**
   * null in plans of older versions, which are about all of the building.
   */
  scope: ScopeSection | null;
  coverage: CoverageSection;
  /**
   * Covered share of the scannable area after 1, 2, ... stations in the order of choice.
   */
  coverage_curve: (number | null)[];
  optimality: OptimalitySection;
  registration: RegistrationSection;
  /**
   * null where none was computed.
   */
  route: RouteSection | null;
  /**
   * null where no route was computed.
   */
  field_time: FieldTimeSection | null;
  sealed: UnreachableSection[];
  /**
   * By element and floor.
   */
  unseen: UnseenSection[];
  why: WhySection | null;
  /**
   * null where not required, and in plans of older versions.
   */
  judge: IndependentCheck | null;
  /**
   * One line each, for the user.
   */
  warnings: string[];
  /**
   * Engine and device that scanned. May differ between equal plans.
   */
  device: string;
  /**
   * Packages at work. May differ between equal plans.
   */
  versions: {
    [k: string]: string;
  };
  /**
   * Seconds per stage. May differ between equal plans.
   */
  timings_s: {
    [k: string]: number;
  };
}
