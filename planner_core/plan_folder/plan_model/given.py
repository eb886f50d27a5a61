"""What the plan of a plan.json is made from: scene, scanner, requirements, settings, site."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, field_serializer

from planner_core.coordinates.georeference import GeoreferenceSection
from planner_core.documents import Document, Number, RoundTripModel, Whole, YesNo, words_of
from planner_core.model import (
    Doors,
    Glass,
    GroundPick,
    KeepOut,
    NetworkKind,
    Objective,
    OverlapMeasure,
    OverlapOf,
    PartRequirement,
    PlanSettings,
    PointLimits,
    PreAlignment,
    PriorStation,
    Requirements,
    Role,
    ScanBy,
    Scanner,
    Scope,
    Site,
)
from planner_core.plan_folder.plan_model.values import (
    Area,
    Corner,
    Count,
    DoorsWord,
    GlassWord,
    Point,
    Required,
    SeenFrom,
    Share,
    Text,
    UpAxisWord,
)
from planner_core.scene.load import LoadOptions


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


class LoadOptionsSection(RoundTripModel):
    """How the file was read; null: by its own entries. What it takes to read it again."""

    dataclass: ClassVar = LoadOptions

    metres_per_unit: Number | None
    """As the user gave it."""
    up_axis: UpAxisWord | None
    """As the user gave it."""
    skip_bad_faces: YesNo
    """Faces of vertices that do not exist were to be dropped."""
    glass: GlassWord
    doors: DoorsWord = Doors.SHUT
    doors_open: tuple[str, ...] = ()
    """GlobalIds of doors that were taken to be open whatever `doors` is."""
    doors_shut: tuple[str, ...] = ()
    """GlobalIds of doors that were taken to be shut whatever `doors` is."""
    leave_out: tuple[str, ...] = ()
    """Classes, and patterns of names, whose elements were left out."""


_Format = Literal["ifc", "obj", "ply", "stl", "gltf", "usd", "memory"]


class SceneFileSection(Document):
    """A file of a scene of several, as it was read."""

    file: Text
    """Its name, without its folder."""
    sha256: str
    """Of its bytes, hexadecimal."""
    format: _Format
    schema_: Annotated[str, Field(alias="schema")]
    """As stated in it; empty where it states nothing."""
    units: str
    metres_per_unit: Annotated[Number, Field(gt=0)]
    up_axis: UpAxisWord
    load_options: LoadOptionsSection


class SceneSection(Document):
    """The scene as it was read."""

    file: Text
    """Name of the scene file, without its folder; of several the first."""
    sha256: str
    """Of the file's bytes, hexadecimal; empty for a scene from memory."""
    format: _Format
    """What was read."""
    schema_: Annotated[str, Field(alias="schema")]
    """As stated in the file: IFC2X3, glTF 2.0 ...; empty where it states nothing."""
    units: str
    """Unit of the file: metre, millimetre, inch ..."""
    metres_per_unit: Annotated[Number, Field(gt=0)]
    up_axis: UpAxisWord
    glass: GlassWord = Glass.RETURN
    """What glass was taken to do to beams."""
    doors: DoorsWord = Doors.SHUT
    """Which doors were taken to be open: none, those indoors, or those that lead outdoors, too; `outside`: all, and
    stations may stand outdoors."""
    load_options: LoadOptionsSection | None = None
    other_files: tuple[SceneFileSection, ...] = ()
    """The files after the first, where the scene is several; entries above of a file are of the first."""
    n_doors_open: Count = 0
    """Doors whose leaves were left out."""
    offset: Point
    """Scene position = local position + offset; the USD stage is local."""
    georeference: GeoreferenceSection | None = None
    """Where on earth the scene is by its file, unchecked; null: not stated."""
    n_elements: Count
    n_triangles: Count
    glass_area_m2: Area = 0.0
    """Faces of clear glass by the file, both of a pane; `glass` is what they were taken to do."""
    mirror_area_m2: Area = 0.0
    n_triangles_passing: Count = 0
    """Triangles that let beams pass: glass."""
    n_triangles_stopping: Count = 0
    """Triangles that end beams without a return: mirrors, and glass where the user chose so."""
    repairs: Repairs


class SourceSection(Document):
    """Where the scene files were, seen from the plan folder. May differ between equal plans."""

    path: str
    """Relative to the plan folder, with forward slashes; of several files the first."""
    other_paths: tuple[str, ...] = ()
    """The same of `scene.other_files`, in their order."""


# ---------------------------------------------------------------------------------- what the plan is made from
class ScannerSection(RoundTripModel):
    """The scanner's specification in full."""

    dataclass: ClassVar = Scanner

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
    instrument_height_usual_m: Number | None = None
    """What a crew sets its tripod to; null: any height of the range is as good."""
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
    """What both are measured at: 1/e, 1/e2, FWHM; empty: not given."""
    wavelength_m: Number | None = None
    dual_axis_compensator: YesNo | None = None
    pre_alignment: Annotated[PreAlignment, words_of(PreAlignment)] = PreAlignment.MANUAL
    """How well a scan's pose is known before it is registered."""

    @field_serializer("azimuth_range_rad")
    def _or_empty(self, value: tuple[float, float] | None) -> Sequence[float]:
        return value or ()


class LimitsSection(RoundTripModel):
    """Limits on how surfaces are seen; null: none."""

    dataclass: ClassVar = PointLimits

    spacing_m: Number | None = None
    """Greatest distance between neighbouring points."""
    range_m: Number | None = None
    incidence_rad: Number | None = None
    noise_m: Number | None = None
    """Greatest one sigma of range noise."""


class PartSection(RoundTripModel):
    """What is required of a part of the building besides."""

    dataclass: ClassVar = PartRequirement

    name: str
    coverage: Required
    asked: LimitsSection
    seen_from: SeenFrom
    floors: tuple[str, ...]
    classes: tuple[str, ...]
    zone: tuple[Corner, ...]
    """Corners (x, y) of a polygon in plan, scene coordinates; empty: everywhere."""
    heights_m: Annotated[Corner | None, Field(alias="heights")]
    """Lowest and highest z, scene coordinates."""


class ResultSection(RoundTripModel):
    """What became of one thing that was required: of a floor, overall, of a part."""

    name: str
    required: Required
    seen_from: SeenFrom = 1
    asked: LimitsSection = LimitsSection()
    achievable_area_m2: Area
    covered_area_m2: Area
    total_area_m2: Area
    fraction_of_achievable: Share
    met: YesNo


class RequirementsSection(RoundTripModel):
    """What was required, and what became of it."""

    dataclass: ClassVar = Requirements

    coverage: Required
    """Share of the scannable area required, overall and on each floor."""
    overlap: Required
    """Share of seen area that makes two stations linked; 0: not required."""
    overlap_measure: Annotated[OverlapMeasure, words_of(OverlapMeasure)] = OverlapMeasure.SMALLER_SHARE
    """What both see, as a share of what the one sees that sees more, or (jaccard) of what either sees."""
    overlap_of: Annotated[OverlapOf, words_of(OverlapOf)] = OverlapOf.ALL_SEEN
    """Which surface overlap is counted on: all that a station sees, or where it meets the limits required of all."""
    floors: tuple[str, ...]
    """Ids or names of the floors that were planned; empty: all."""
    asked: LimitsSection = LimitsSection()
    seen_from: SeenFrom = 1
    reflectivity: Number = 0.8
    """Of the surfaces, for range noise."""
    network: Annotated[NetworkKind, words_of(NetworkKind, "joined", "loops")] = NetworkKind.NONE
    """How links must connect the stations, as far as candidates can be linked at all."""
    min_strength: Number = 0.0
    """Least strength of a link that counts."""
    min_probability: Number = 0.0
    """Least probability with which the scans of a link that counts register; 0: not required."""
    pre_alignment: Annotated[PreAlignment, words_of(PreAlignment)] | None = None
    """Where registration starts; null: as the scanner has it."""
    scope: Annotated[Scope, words_of(Scope)] = Scope.ALL
    """What of the building was to count, and where stations were to stand."""
    deliverable: Text | None = None
    """Deliverable from which limits and overlap were taken where none were given, such as survey; null: none."""
    parts: tuple[PartSection, ...] = ()
    results: tuple[ResultSection, ...] = ()
    """Of floors, overall, of parts."""


class SettingsSection(RoundTripModel):
    """Everything else that decided the plan, and the size of the problem."""

    dataclass: ClassVar = PlanSettings

    objective: Annotated[Objective, words_of(Objective)] = Objective.FEWEST
    """What the plan is best in."""
    grid_step_m: Number
    instrument_heights_m: tuple[Number, ...]
    """Heights that were given; empty: the scanner's range in steps of height_step_m."""
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
    """As given; null: by the scanner's mode."""
    set_up_s: Number = 60.0
    set_up_tolerance_m: Number = 0.0
    """Links hold wherever within this of its mark, and half of it in height, each station is set up."""
    walking_m_per_s: Number = 1.0
    n_candidates: Count
    n_patches: Count


class KeepOutSection(RoundTripModel):
    """An area where nobody goes, or, with `access`, the only one on its floor where somebody does."""

    dataclass: ClassVar = KeepOut

    name: str
    floor: str
    access: YesNo
    outline_m: Annotated[tuple[Corner, ...], Field(alias="outline")]


class PriorSection(RoundTripModel):
    """A station, or a forbidden position, given before planning."""

    dataclass: ClassVar = PriorStation

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


class PickSection(RoundTripModel):
    """A surface marked as ground, or unmarked: the coplanar region around a point."""

    dataclass: ClassVar = GroundPick

    point_m: Annotated[Point, Field(alias="point")]
    is_ground: YesNo
    floor: str
    """Id or name; empty: the nearest."""


class SiteSection(RoundTripModel):
    """Where the crew may go, and stations given before planning."""

    dataclass: ClassVar = Site

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
