"""plan.json as one model, which docs/formats/plan.schema.json is made of.

Keys keep their meaning and are never removed under this schema. Keys that came after the first version have a default,
which is what older plans say by leaving them out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, field_serializer, model_validator

from planner_core.coordinates.georeference import GeoreferenceSection
from planner_core.documents import Document, Mirror, Number, Whole, YesNo, words_of
from planner_core.errors import PlanFolderError
from planner_core.model import (
    REASONS,
    Doors,
    Glass,
    GroundPick,
    KeepOut,
    Link,
    NetworkKind,
    Objective,
    PartRequirement,
    PlanSettings,
    PointLimits,
    PriorStation,
    Requirements,
    Role,
    ScanBy,
    Scanner,
    Site,
    UpAxis,
    WeakMotion,
)
from planner_core.network.weak_motion import words_by_axes
from planner_core.scene.load import LoadOptions
from planner_core.scene.repair import MAX_COORDINATE_M

SCHEMA = "tlsplan/plan/1"
"""Grows by new keys only; a change of meaning gets a new number."""
#: Areas and shares are rounded where they are written; no area in m2 is larger.
_ROUNDING, _MOST = 1e-6, 1e12


def _rounded(digits: int) -> AfterValidator:
    """Micrometres for lengths: a file shows no more than is meant. What was read does not change by it."""
    return AfterValidator(lambda value: round(value, digits) + 0.0)


def _to_micro(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(part, 6) + 0.0 for part in direction)
    return x, y, z


def _pair(link: Any) -> Any:
    return (link.a, link.b) if isinstance(link, Link) else link


Text = Annotated[str, Field(min_length=1)]
Metres = Annotated[Number, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Point = tuple[Metres, Metres, Metres]
Corner = tuple[Metres, Metres]
Pair = Annotated[tuple[str, str], BeforeValidator(_pair)]
Area = Annotated[Number, Field(ge=-_ROUNDING, le=_MOST), _rounded(6), WithJsonSchema({"type": "number", "minimum": 0})]
_SHARE = {"type": "number", "minimum": 0, "maximum": 1}
Required = Annotated[Number, Field(ge=0.0, le=1.0)]
"""A share with all its digits: what was required has to be read back as it was, or another plan comes of it."""
Share = Annotated[Number, Field(ge=0.0, le=1 + _ROUNDING), _rounded(9), WithJsonSchema(_SHARE)]
Strength = Annotated[Number, Field(ge=0.0, le=_MOST)]
Count = Annotated[Whole, Field(ge=0)]
Seconds = Annotated[Number, Field(ge=0.0), _rounded(1)]
GlassWord = Annotated[Glass, words_of(Glass)]
DoorsWord = Annotated[Doors, words_of(Doors)]
UpAxisWord = Annotated[UpAxis, words_of(UpAxis)]
Reason = Annotated[str, Field(examples=list(REASONS), description="docs/method/unseen.md says what reasons mean.")]
FloorId = Annotated[str, Field(description="Id of a floor; empty: of none.")]
ElementNumber = Annotated[Count, Field(description="Number of the element in the scene.")]
SeenFrom = Annotated[Whole, Field(ge=1, description="Stations that must each meet the limits for a surface to count.")]


# ------------------------------------------------------------------------------------------------- scene
class Repairs(Document):
    """Faces that were dropped on loading, by reason."""

    faces_read: Count
    non_finite: Count
    degenerate: Count
    duplicate: Count
    bad_index: Count
    stray: Count = 0
    dropped: tuple[str, ...]
    """Up to 100 lines on faces that were dropped: element, face, reason."""
    warnings: tuple[str, ...]
    """What loading wants the user to know."""


class LoadOptionsSection(Mirror):
    """How the file was read; null: as it says of itself. What it takes to read it again."""

    made: ClassVar = LoadOptions

    metres_per_unit: Number | None
    """As the user told."""
    up_axis: UpAxisWord | None
    """As the user told."""
    skip_bad_faces: YesNo
    """Faces of vertices that do not exist were to be dropped."""
    glass: GlassWord
    doors: DoorsWord = Doors.SHUT


class SceneSection(Document):
    """The scene as it was read."""

    file: Text
    """Name of the scene file, without its folder."""
    sha256: str
    """Of the file's bytes, hexadecimal; empty for a scene from memory."""
    format: Literal["ifc", "obj", "ply", "stl", "gltf", "usd", "memory"]
    """What was read."""
    schema_: Annotated[str, Field(alias="schema")]
    """What the file says of itself: IFC2X3, glTF 2.0 ...; empty where it says nothing."""
    units: str
    """Unit of the file: metre, millimetre, inch ..."""
    metres_per_unit: Annotated[Number, Field(gt=0)]
    up_axis: UpAxisWord
    glass: GlassWord = Glass.RETURN
    """What glass was taken to do to beams."""
    doors: DoorsWord = Doors.SHUT
    """Which doors were taken to be open: none, those indoors, or those that lead outdoors, too."""
    load_options: LoadOptionsSection | None = None
    n_doors_open: Count = 0
    """Doors whose leaves were left out."""
    offset: Point
    """Scene position = local position + offset; the USD stage is local."""
    georeference: GeoreferenceSection | None = None
    """What the scene file says of where it is on earth, unchecked; null: nothing."""
    n_elements: Count
    n_triangles: Count
    glass_area_m2: Area = 0.0
    """Faces that the file says are of clear glass, both of a pane; `glass` says what they were taken to do."""
    mirror_area_m2: Area = 0.0
    n_triangles_passing: Count = 0
    """Triangles that let beams pass: glass."""
    n_triangles_stopping: Count = 0
    """Triangles that end beams without a return: mirrors, and glass where the user says so."""
    repairs: Repairs


class SourceSection(Document):
    """Where the scene file was, seen from the plan folder. May differ between equal plans."""

    path: str
    """Relative to the plan folder, with forward slashes."""


# ---------------------------------------------------------------------------------- what the plan is made from
class ScannerSection(Mirror):
    """The scanner's specification in full."""

    made: ClassVar = Scanner

    name: str
    mode: str = ""
    """Which of its resolutions; empty: it has one."""
    title: str
    source: str
    """Where the figures are from."""
    range_min_m: Annotated[Number, Field(ge=0)]
    range_max_m: Annotated[Number, Field(gt=0)]
    n_azimuths: Annotated[Whole, Field(ge=1)]
    n_channels: Annotated[Whole, Field(ge=1)]
    elevation_rad: Annotated[tuple[Number, ...], Field(min_length=1)]
    """One angle per channel, up from the horizontal, highest first."""
    azimuth_range_rad: Annotated[
        tuple[Number, Number] | None,
        BeforeValidator(lambda value: value or None),
        WithJsonSchema({"type": "array", "items": {"type": "number"}, "maxItems": 2}),
    ] = Field(None, json_schema_extra={"default": []})
    """First and last azimuth of a sector, counter-clockwise from +x; empty: a full turn from 0."""
    azimuth_offset_rad: tuple[Number, ...] = ()
    """One angle per channel, added to its azimuths; empty: none."""
    inverted: YesNo = False
    """Hangs upside down: turned by 180 degrees about its x axis."""
    instrument_height_min_m: Number
    instrument_height_max_m: Number
    seconds_per_scan: Number | None = None
    """Of a whole scan in this mode; null, as of all that follows: not known."""
    range_noise: tuple[tuple[Number, Number, Number], ...] = ()
    """Rows of range in metres, reflectivity, one sigma in metres; empty: not known."""
    ranging_accuracy: tuple[Number, Number] | None = None
    """[a, b]: a range r is accurate to a + b r metres."""
    angular_accuracy_rad: Number | None = None
    beam_divergence_rad: Number | None = None
    """Full angle."""
    beam_diameter_m: Number | None = None
    """At the exit."""
    beam_width_at: str = ""
    """What both are measured at: 1/e, 1/e2, FWHM; empty: not told."""
    wavelength_m: Number | None = None
    dual_axis_compensator: YesNo | None = None

    @field_serializer("azimuth_range_rad")
    def _or_empty(self, value: tuple[float, float] | None) -> Sequence[float]:
        return value or ()


class AskedSection(Mirror):
    """Limits on how surfaces are seen; null: none."""

    made: ClassVar = PointLimits

    spacing_m: Number | None = None
    """Greatest distance between neighbouring points."""
    range_m: Number | None = None
    incidence_rad: Number | None = None
    noise_m: Number | None = None
    """Greatest one sigma of range noise."""


class PartSection(Mirror):
    """What is required of a part of the building besides."""

    made: ClassVar = PartRequirement

    name: str
    coverage: Required
    asked: AskedSection
    seen_from: SeenFrom
    floors: tuple[str, ...]
    classes: tuple[str, ...]
    zone: tuple[Corner, ...]
    """Corners (x, y) of a polygon in plan, scene coordinates; empty: everywhere."""
    heights_m: Annotated[Corner | None, Field(alias="heights")]
    """Lowest and highest z, scene coordinates."""


class ResultSection(Mirror):
    """What became of one thing that was required: of a floor, overall, of a part."""

    name: str
    required: Required
    seen_from: SeenFrom = 1
    asked: AskedSection = AskedSection()
    achievable_area_m2: Area
    covered_area_m2: Area
    total_area_m2: Area
    fraction_of_achievable: Share
    met: YesNo


class RequirementsSection(Mirror):
    """What was required, and what became of it."""

    made: ClassVar = Requirements

    coverage: Required
    """Share of the achievable area required, overall and on each floor."""
    overlap: Required
    """Share of seen area that makes two stations linked."""
    floors: tuple[str, ...]
    """Ids or names of the floors that were planned; empty: all."""
    asked: AskedSection = AskedSection()
    seen_from: SeenFrom = 1
    reflectivity: Number = 0.8
    """Of the surfaces, for range noise."""
    network: Annotated[NetworkKind, words_of(NetworkKind, "joined", "loops")] = NetworkKind.NONE
    """How links must connect the stations, as far as candidates can be linked at all."""
    min_strength: Number = 0.0
    """Least strength of a link that counts."""
    parts: tuple[PartSection, ...] = ()
    results: tuple[ResultSection, ...] = ()
    """Of floors, overall, of parts."""


class SettingsSection(Mirror):
    """Everything else that decided the plan, and the size of the problem."""

    made: ClassVar = PlanSettings

    objective: Annotated[Objective, words_of(Objective)] = Objective.FEWEST
    """What the plan is best in."""
    grid_step_m: Number
    instrument_heights_m: tuple[Number, ...]
    """Heights that were asked for; empty: the scanner's range in steps of height_step_m."""
    height_step_m: Number
    clearance_m: Number
    ground_ring_radius_m: Number
    n_ground_ring_rays: Count
    max_patch_area_m2: Number
    scan_mode: Annotated[ScanBy, WithJsonSchema({"enum": ["beams", "patches"], "type": "string"})] = ScanBy.BEAMS
    """What visibility was computed by: every beam, or samples of every patch."""
    special_places: YesNo = False
    """Doorways, room centres and landings were candidates besides the grid."""
    refine: YesNo = False
    max_stations: Whole | None = None
    seconds_per_scan: Number | None = None
    """As told; null: by the scanner's mode."""
    set_up_s: Number = 60.0
    walking_m_per_s: Number = 1.0
    n_candidates: Count
    n_patches: Count


class KeepOutSection(Mirror):
    """An area where nobody goes, or, with `access`, the only one on its floor where somebody does."""

    made: ClassVar = KeepOut

    name: str
    floor: str
    access: YesNo
    outline_m: Annotated[tuple[Corner, ...], Field(alias="outline")]


class PriorSection(Mirror):
    """A station, or a forbidden position, given before planning."""

    made: ClassVar = PriorStation

    id: str
    role: Annotated[Role, words_of(Role)]
    position_m: Annotated[Point, Field(alias="position")]
    floor: str
    instrument_height_m: Number | None
    radius_m: Annotated[
        Number,
        BeforeValidator(lambda value: PriorStation.radius_m if value is None else value),
        WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "null"}]}),
    ]
    """Of a forbidden place."""

    @field_serializer("radius_m")
    def _of_forbidden(self, value: float) -> float | None:
        return value if self.role == Role.FORBIDDEN else None


class PickSection(Mirror):
    """A surface marked as ground, or unmarked: the coplanar region around a point."""

    made: ClassVar = GroundPick

    point_m: Annotated[Point, Field(alias="point")]
    is_ground: YesNo
    floor: str
    """Id or name; empty: the nearest."""


class SiteSection(Mirror):
    """Where the crew may go, and stations given before planning."""

    made: ClassVar = Site

    entrances_m: Annotated[tuple[Point, ...], Field(alias="entrances")] = ()
    keep_out: tuple[KeepOutSection, ...] = ()
    prior: Annotated[tuple[PriorSection, ...], Field(alias="settled")] = ()
    mover_radius_m: Number | None = None
    step_m: Number | None = None
    mover_height_m: Number | None = None
    opens_doors: YesNo = True
    start_m: Annotated[Point | None, Field(alias="start")] = None
    end_m: Annotated[Point | None, Field(alias="end")] = None
    returns: YesNo = False
    ground_picks: tuple[PickSection, ...] = ()
    """In the order they were made."""


# ------------------------------------------------------------------------------------------------ the plan
def _own_ids(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    ids = [row.id for row in rows]
    for place, name in enumerate(ids):
        if name in ids[:place]:
            raise PlanFolderError(
                f"got the id {name!r} of [{place}] a second time, expected one of its own; plan again"
            )
    return rows


class FloorSection(Document):
    """A floor."""

    id: Text
    """F0 is the lowest that was found; floors that people marked have the numbers behind those found."""
    name: str
    elevation_m: Metres
    """Height of the ground."""
    ground_area_m2: Area | None
    bounds: tuple[Corner, Corner]
    """[[x_min, y_min], [x_max, y_max]] of the ground."""
    origin: Literal["slab", "surface", "storey-elevation", "marked"]
    """How the ground was found."""
    n_stations: Count

    @model_validator(mode="after")
    def _lower_corner_first(self) -> FloorSection:
        (x0, y0), (x1, y1) = self.bounds
        if x1 < x0 or y1 < y0:
            raise PlanFolderError(
                f"got bounds {self.bounds}, expected the lower corner first: [[x_min, y_min], ...]; plan again"
            )
        return self


class LossSection(Mirror):
    """What a requirement would lose without a station."""

    requirement: str
    """Name of one of `requirements.results`."""
    area_m2: Area
    """Of it, that no longer would be as required."""
    fraction_of_achievable: Share
    """Of the requirement, without this station."""
    met: YesNo
    """Whether the requirement would be met without this station."""


class StationSection(Document):
    """A station."""

    id: Text
    floor: FloorId
    order: Whole
    """Order to visit."""
    position: Point
    """The sensor's origin."""
    instrument_height_m: Metres | None
    """Sensor above the ground below it; null where that is unknown."""
    fixed: YesNo
    """Given by the user, not chosen."""
    covered_area_m2: Area
    """Seen from here, as well as is required of all; floors that are not asked for count too."""
    own_area_m2: Area
    """What is required and would no longer be covered without this station; of floors not asked for, nothing."""
    lost_area_m2: Area | None = None
    """Achievable surface on which some requirement would no longer be met without it; null: not worked out."""
    losses: tuple[LossSection, ...] | None = None
    """By requirement, of those that would lose something."""


class CoverageFigures(Mirror):
    """Coverage of surface."""

    achievable_area_m2: Area
    """Seen by at least one admissible candidate or by a station of the plan."""
    total_area_m2: Area
    """All surface of the model that counts here, the inside of walls included."""
    covered_area_m2: Area
    """Seen by at least one station of the plan."""
    fraction_of_achievable: Share
    """covered / achievable."""
    fraction_of_total: Share
    """covered / total."""


class _OfFloor(Document):
    floor: Text
    """Id of a floor."""


class FloorCoverage(CoverageFigures, _OfFloor):
    """Coverage of a floor."""


class _OnPatches(Document):
    max_patch_area_m2: Annotated[Number, Field(ge=0)]
    """Coverage is counted on patches no larger than this."""


class CoverageSection(CoverageFigures, _OnPatches):
    """Coverage, overall and floor by floor."""

    floors: tuple[FloorCoverage, ...]
    """In the order of `floors`."""


class OptimalitySection(Document):
    """How good the plan is proven to be."""

    objective: str
    stations: Count
    lower_bound: Annotated[Whole, Field(ge=1)] | None
    """No plan on these candidates (and given stations) that meets the required coverage has fewer stations; null where
    no bound is known."""
    gap: Annotated[Number, Field(le=1.0), _rounded(9)] | None
    """(stations - lower_bound) / stations; null where no bound is known, or where coverage misses the requirement."""
    proven: YesNo
    """This plan meets the required coverage, and no plan on these candidates that does has fewer stations."""
    why_stopped: str = ""
    """Why the search for fewer stations ended: proven, work limit, time limit, interrupted, earlier stations kept;
    empty where the method does not search."""
    n_candidates_bounded: Count | None = None
    """Candidates that the lower bound holds for: grid, doorways, rooms, landings, given stations, in the connected
    components that the plan is made in. Positions off the grid may do better than the bound says."""
    greedy_stations: Count | None = None
    """Stations that greedy selection takes for the same; null: not known."""
    value: Number | None = None
    """Of another objective than fewest stations: seconds in the field, or fraction of the achievable area covered."""
    bound: Number | None = None
    """What no plan on these candidates is better than, in the same unit."""


class WeakMotionSection(Mirror):
    """A motion; its direction is a unit vector in axes of the scene."""

    made: ClassVar = WeakMotion

    kind: Literal["shift", "turn"]
    direction: Annotated[tuple[Number, Number, Number], AfterValidator(_to_micro)]


class LinkSection(Mirror):
    """Overlap of two stations."""

    a: str
    b: str
    overlap: Share
    """The smaller of both shares of seen area that the other sees too."""
    strength: Annotated[Strength, _rounded(9)] | None
    """How well the shared surface holds the two together in its weakest direction; null where not computed."""
    weak_axis: str = ""
    """The motion that the shared surface holds least, in words by axes of the scene; empty where not computed."""
    weak_motion: WeakMotionSection | None = None
    """The same as kind and direction; null where not computed, and in plans of older versions."""

    @model_validator(mode="before")
    @classmethod
    def _of_link(cls, value: Any) -> Any:
        if not isinstance(value, Link):
            return value
        strength = None if math.isnan(value.strength) else value.strength
        motion = value.weak_motion
        return {**vars(value), "strength": strength, "weak_axis": words_by_axes(motion)}


class NetworkSection(Mirror):
    """Stations that links join."""

    stations: tuple[str, ...]
    floors: tuple[str, ...]
    n_links: Count
    bridges: tuple[Pair, ...]
    """Links without which it falls apart."""
    articulations: tuple[str, ...]
    """Stations without which the others fall apart."""
    bottleneck: LinkSection | None
    """The link that all hangs on: smallest overlap on the best ways between stations."""
    two_connected: YesNo


class GapSection(Mirror):
    """Two networks, by their places in the list, and the link between them that comes nearest to counting."""

    networks: tuple[Count, ...]
    best: LinkSection


class RegistrationSection(Document):
    """Links between stations, and what they join."""

    threshold: Required
    """Minimum overlap of a link."""
    min_strength: Strength = 0.0
    """Strength from which on a link counts."""
    connected: YesNo
    """Links of at least the threshold join all stations."""
    links: tuple[LinkSection, ...]
    networks: tuple[NetworkSection, ...] = ()
    """Largest first."""
    floor_joins: tuple[Pair, ...] = ()
    """Links that count, between stations of different floors."""
    gaps: tuple[GapSection, ...] = ()


class LegSection(Document):
    """The way between two stops."""

    from_: Annotated[str | None, Field(alias="from")]
    """Id of a station; null: the start."""
    to: str | None
    """Id of a station; null: the end, or the start of a route that returns."""
    length_m: Annotated[Number, Field(ge=0)] | None
    """null where it can't be walked."""
    floors: tuple[str, ...]
    """Ids of the floors passed, in their order."""
    points: tuple[Point, ...]
    """Corners of the way, on the ground; empty where it can't be walked."""


class RouteSection(Document):
    """The route through the stations."""

    length_m: Annotated[Number, Field(ge=0)]
    """Along the legs that can be walked."""
    n_unwalkable: Count
    """Legs that no way inside the model leads along."""
    returns: YesNo
    """The route ends where it begins."""
    exact: YesNo
    """No order of these stations, a storey at a time, makes a shorter route."""
    start: Point | None
    """Where the route begins, on the ground; null: at the first station."""
    end: Point | None
    """Where it ends; null: at the last station, or where it begins."""
    order: tuple[str, ...]
    """Ids of all stations in the order of visits; those left out last."""
    left_out: tuple[str, ...]
    """Ids of stations to which no way leads."""
    legs: tuple[LegSection, ...]
    """From stop to stop, in their order."""


class FieldTimeSection(Mirror):
    """Seconds in the field."""

    scanning_s: Seconds | None
    """null where nobody tells how long a scan takes."""
    set_up_s: Seconds
    """Of all stations."""
    walking_s: Seconds
    """Along the legs that can be walked."""
    total_s: Seconds | None
    """The sum; null where a part is not known."""


class SealedSection(Document):
    """A room that no entrance leads to; nothing is planned in it."""

    floor: FloorId
    area_m2: Area
    """Ground that a person could stand on."""
    inside: Point
    """A place in it, on the ground."""


class UnseenSection(Document):
    """Achievable surface of an element that the plan leaves unseen."""

    element: ElementNumber
    name: str
    kind: str
    source_id: str
    """What finds it in the source: IFC GlobalId, prim path ..."""
    floor: FloorId
    unseen_area_m2: Area
    achievable_area_m2: Area


# ----------------------------------------------------------------------------------------------------- why
class RoomSection(Document):
    """A room that the source names."""

    name: str
    source_id: str
    """IFC GlobalId."""


class OwnPartSection(Document):
    """Surface of an element in a room that only one station sees."""

    element: ElementNumber
    name: str
    room: RoomSection | None
    """null where it is in no room, or the source names none."""
    area_m2: Area


class StationReasonSection(Document):
    """What only this station sees."""

    station: str
    own_area_m2: Area
    """What would no longer be covered without it."""
    own_parts: tuple[OwnPartSection, ...]
    """The largest parts of that, largest first."""
    linked: tuple[str, ...]
    """Stations it has links to that count for registration."""


class StepSection(Mirror):
    """Coverage after one station more."""

    station: str
    covered_area_m2: Area
    fraction_of_achievable: Share | None


class PieceSection(Document):
    """Surface that hangs together."""

    area_m2: Area
    centroid: Point
    """Centre of its area; of a bent piece it need not lie on it."""
    box: tuple[Point, Point]
    """Lowest and highest corner."""
    patch: Count
    """Number of the patch nearest to the centre."""


class BestPositionSection(Document):
    """The candidate that sees most of a surface."""

    position: Point
    """The sensor's origin."""
    sees_m2: Area
    """Of this surface."""
    adds_m2: Area
    """Of all that is not worth a station."""


class _SurfaceOfElement(Document):
    element: ElementNumber
    name: str
    kind: str
    source_id: str
    room: RoomSection | None
    """null where it is in no room, or the source names none."""
    floor: FloorId


class _WithReason(Document):
    reason: Reason


class _InPieces(Document):
    area_m2: Area
    n_pieces: Annotated[Whole, Field(ge=1)]
    """Connected pieces it is in."""
    pieces: tuple[PieceSection, ...]
    """The largest, largest first."""


class LeftSurfaceSection(_InPieces, _SurfaceOfElement):
    """Surface of one element, in one room, that is not covered."""


class UnseenSurfaceSection(_InPieces, _WithReason, _SurfaceOfElement):
    """The same, and why."""

    best_position: Annotated[BestPositionSection | None, Field(alias="best_spot")]
    """null unless the reason is `not worth a station`."""


class WhySection(Document):
    """What each station adds, and why the unseen stays unseen: docs/method/unseen.md."""

    stations: tuple[StationReasonSection, ...]
    """One per station, in the order of `stations`."""
    curve: tuple[StepSection, ...]
    """Coverage after 1, 2, ... stations, always taking the one that adds most."""
    area_by_reason_m2: dict[Reason, Area]
    """Of all that is in scope, each patch counted once; covered comes first."""
    unlisted_area_m2: dict[Reason, Area]
    """Of surface that `unseen_surfaces` leaves out: slivers, and what is inside solids."""
    unseen_surfaces: tuple[UnseenSurfaceSection, ...]
    """By element, room, floor and reason, largest first."""


class PlanDocument(Document):
    """plan.json of tlsplan, schema tlsplan/plan/1. Lengths are metres, areas square metres, shares lie in [0, 1].
    Positions and elevations are in the scene frame: metres, z up, the source's own origin. A number that is unknown is
    null. Keys are never removed or given another meaning under this schema; new ones may come, so readers ignore keys
    they do not know. Keys with a default may be missing, as in plans of older versions.
    """

    schema_: Annotated[Literal["tlsplan/plan/1"], Field(alias="schema")]
    """Name and number of this contract."""
    scene: SceneSection
    source: SourceSection | None = None
    """null for scenes from memory."""
    scanner: ScannerSection
    requirements: RequirementsSection
    method: str
    method_options: dict[str, str] = Field({})
    """Options of the method that the user set, by name."""
    seed: Whole
    settings: SettingsSection
    site: SiteSection = SiteSection()
    floors: Annotated[tuple[FloorSection, ...], AfterValidator(_own_ids)]
    """Lowest first."""
    stations: Annotated[tuple[StationSection, ...], AfterValidator(_own_ids)]
    """In the order to visit."""
    coverage: CoverageSection
    coverage_curve: tuple[Share | None, ...]
    """Covered share of the achievable area after 1, 2, ... stations in the order of choice."""
    optimality: OptimalitySection
    registration: RegistrationSection
    route: RouteSection | None = None
    """null where none was looked for."""
    field_time: FieldTimeSection | None = None
    """null where no route was looked for."""
    sealed: tuple[SealedSection, ...] = ()
    unseen: tuple[UnseenSection, ...]
    """By element and floor."""
    why: WhySection | None = None
    warnings: tuple[str, ...]
    """One line each, for the user."""
    device: str
    """Engine and device that scanned. May differ between equal plans."""
    versions: dict[str, str]
    """Packages at work. May differ between equal plans."""
    timings_s: dict[str, Number]
    """Seconds per stage. May differ between equal plans."""
