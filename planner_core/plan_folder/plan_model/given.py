"""What the plan of a plan.json is made from: scene, scanner, requirements, settings, site.

Most of it is the dataclasses of `planner_core.model` themselves. Defaults here are what older plans mean by leaving a
key out, which need not be today's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, WithJsonSchema

from planner_core.documents import Document, Number, YesNo, document
from planner_core.model import (
    Doors,
    Georeference,
    Glass,
    NetworkKind,
    PointLimits,
    Requirements,
    VisibilityMode,
)
from planner_core.model.planning import PlanParameters
from planner_core.model.values import (
    Area,
    Count,
    DoorsWord,
    GlassWord,
    NetworkWord,
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
    load_options: LoadOptions


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
    load_options: LoadOptions | None = None
    other_files: tuple[SceneFileSection, ...] = ()
    """The files after the first, where the scene is several; entries above of a file are of the first."""
    n_doors_open: Count = 0
    """Doors whose leaves were left out."""
    offset: Point
    """Scene position = local position + offset; the USD stage is local."""
    georeference: Georeference | None = None
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
class ResultSection(Document):
    """What became of one thing that was required: of a floor, overall, of a part."""

    name: str
    required: Required
    seen_from: SeenFrom = 1
    limits: Annotated[PointLimits, Field(alias="asked")] = PointLimits()
    achievable_area_m2: Area
    covered_area_m2: Area
    total_area_m2: Area
    fraction_of_achievable: Share
    met: YesNo
    as_set_up: Annotated[Share | None, Field(exclude_if=lambda value: value is None)] = None
    """Fraction that 99 of 100 set-ups cover at least, each station anywhere within `settings.set_up_tolerance_m` of its
    mark; left out where it was not computed."""


@document
@dataclass(frozen=True)
class PlannedRequirements(Requirements):
    """What was required, and what became of it."""

    network: NetworkWord = NetworkKind.NONE
    """How links that count must connect the stations, as far as candidates can be linked at all."""
    min_strength: Number = 0.0
    """Least strength of a link that counts."""
    min_probability: Number = 0.0
    """Least probability with which the scans of a link that counts register; 0: not required."""
    results: tuple[ResultSection, ...] = ()
    """Of floors, overall, of parts."""


@document
@dataclass(frozen=True, kw_only=True)
class PlannedParameters(PlanParameters):
    """Everything else that decided the plan, and the size of the problem."""

    scan_mode: Annotated[VisibilityMode, WithJsonSchema({"enum": ["beams", "patches"], "type": "string"})] = (
        VisibilityMode.BEAMS
    )
    """What visibility was computed by: every beam, or samples of every patch."""
    special_places: YesNo = False
    """Doorways, room centres and landings were candidates besides the grid."""
    refine: YesNo = False
    """Better places off the grid were searched for."""
    set_up_tolerance_m: Number = 0.0
    """Links hold wherever within this of its mark, and half of it in height, each station is set up."""
    n_candidates: Count
    n_patches: Count
