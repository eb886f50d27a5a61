"""What the live routes take and give, as documents: pydantic models, from which the viewer's types are made.

Positions are in the scene frame, metres; areas m^2; a figure that is not known is null.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from planner_core.model import FloatArray, Link, Scene, UnseenPiece
from planner_core.plan_folder.plan_json import link_in_scene, plan_document
from planner_core.plan_folder.plan_model.given import ResultSection
from planner_core.plan_folder.plan_model.results import (
    CoverageFigures,
    FieldTimeSection,
    FloorCoverage,
    LeftSurfaceSection,
    PieceSection,
    RegistrationSection,
    RoomSection,
    RouteSection,
    StationSection,
)
from planner_core.plan_folder.results_json import route_document
from planner_core.plan_folder.viewer_layers import range_step_m
from planner_core.planning.live.figures import LeftSurface
from planner_core.planning.live.live_plan import CloudWindow, DraftFigures, LivePlan, RouteResult
from planner_core.planning.live.preview import Preview
from planner_core.planning.live.tripod_positions import GroundMap
from planner_core.scanner.template import azimuth_step_rad, first_azimuths_rad
from viewer_web.server.answers import Answer

_Metres = Annotated[float, Field(ge=-1e7, le=1e7, allow_inf_nan=False)]


class PreviewQuestion(BaseModel):
    """A station that is being dragged, raised, or about to be added."""

    model_config = ConfigDict(extra="forbid")

    station: Annotated[str, Field(max_length=64)] | None = Field(description="Id of the station; null: a new one.")
    floor: Annotated[str, Field(max_length=200)] = Field(description="Id of its floor.")
    position: Annotated[list[_Metres], Field(min_length=2, max_length=3)] = Field(
        description="[x, y] or [x, y, z]; z, the sensor's, distinguishes grounds above each other."
    )
    instrument_height_m: Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]
    layer: Annotated[str, Field(max_length=32)] = Field(
        "times_seen", description="`times_seen` or a layer of the plan."
    )
    sequence: Annotated[int, Field(ge=0, le=2**53 - 1)] = Field(0, description="Grows with every question of a page.")
    client: Annotated[str, Field(max_length=64)] = Field(
        "", description="Names the page. Where given, questions that a newer one of it has overtaken are not answered."
    )


class RequirementFigure(Answer):
    """How far a requirement is met."""

    name: str
    required: float
    fraction_of_achievable: float
    met: bool


class StationAreas(Answer):
    """What a station covers, and what it alone covers."""

    covered_area_m2: float
    own_area_m2: float


class Joined(Answer):
    """How all stations are connected."""

    connected: bool
    n_networks: int


class PreviewHead(Answer):
    """The head of a preview. Three arrays follow, an entry a patch that differs from the draft: uint32 patches, rising;
    uint16 values of the layer; uint8 times seen, 255 where no candidate can.
    """

    sequence: int
    revision: int
    n_patches_changed: int
    position: tuple[float, float, float] = Field(description="Where the station would stand, the sensor's origin.")
    instrument_height_m: float
    admissible: bool = Field(description="Whether it is a valid tripod position.")
    reason: str = Field(description="Why it is not the requested position, or not valid; empty where it is.")
    coverage: CoverageFigures
    floors: list[FloorCoverage]
    requirements: list[RequirementFigure]
    station: StationAreas
    links: list[Link] = Field(description="Of the station.")
    n_stations: int
    registration: Joined


class GroundHead(Answer):
    """The head of a map of the ground. width x height uint8 follow, row by row from the lowest y: 0 nothing to walk on,
    1 walkable, but no tripod can stand, 2 one can, 3 kept free by the review.
    """

    floor: str
    origin: list[float] = Field(description="[x, y], low corner of the first cell.")
    cell_m: float
    width: int
    height: int


class CloudHead(Answer):
    """The head of a part of a cloud. rows x columns uint16 ranges follow, then uint8 intensities.

    They are those of viewer/clouds once these are unpacked, the angles those of the stage's stations: see
    docs/formats/stage.md.
    """

    rows: int
    columns: int
    range_step_m: float
    elevations_rad: list[float] = Field(description="One a row.")
    azimuths_rad: list[float] = Field(description="Of each row's first beam.")
    azimuth_step_rad: float
    beams: int = Field(description="That the scanner sends into the window; rows x columns of them are here.")


def cloud_head(window: CloudWindow) -> CloudHead:
    """Describe a part of a cloud."""
    template = window.template
    rows, columns = template.shape
    return CloudHead(
        rows=rows,
        columns=columns,
        range_step_m=range_step_m(template),
        elevations_rad=template.elevation_rad.tolist(),
        azimuths_rad=first_azimuths_rad(template).tolist(),
        azimuth_step_rad=azimuth_step_rad(template),
        beams=window.n_beams,
    )


class FiguresOfDraft(Answer):
    """Figures of the draft at a revision of the review; `stations`, `requirements`, `registration` as in plan.json."""

    revision: int
    coverage: CoverageFigures
    floors: list[FloorCoverage]
    requirements: list[ResultSection]
    stations: list[StationSection]
    registration: RegistrationSection
    curve: list[float] = Field(description="Fraction of achievable after 1, 2, ... stations, the steepest first.")
    curve_stations: list[str] = Field(description="In the order of the curve.")
    unseen: list[LeftSurfaceSection] = Field(description="Largest first.")


class RouteOfDraft(Answer):
    """The route through the draft's stations, `route` and `field_time` as in plan.json."""

    revision: int
    route: RouteSection | None
    field_time: FieldTimeSection | None


# ------------------------------------------------------------------------------------------------ from answers
def figures_document(live: LivePlan, figures: DraftFigures, revision: int) -> FiguresOfDraft:
    """Return figures as they are sent."""
    plan = plan_document(figures.plan)
    return FiguresOfDraft(
        revision=revision,
        coverage=plan["coverage"],
        floors=plan["coverage"]["floors"],
        requirements=plan["requirements"]["results"],
        stations=plan["stations"],
        registration=plan["registration"],
        curve=[round(step.fraction_of_achievable, 9) for step in figures.curve],
        curve_stations=[step.station for step in figures.curve],
        unseen=[_unseen(surface, live.survey.scene) for surface in figures.unseen],
    )


def preview_head(live: LivePlan, preview: Preview, *, sequence: int, revision: int) -> PreviewHead:
    """Return the head of a preview."""
    registration, goals = preview.registration, live.goals
    return PreviewHead(
        sequence=sequence,
        revision=revision,
        n_patches_changed=int(preview.patch.size),
        position=_scene_m(preview.station.at_m, live.survey.scene.offset_m),
        instrument_height_m=preview.station.instrument_height_m or 0.0,
        admissible=preview.spot.admissible,
        reason=preview.spot.reason,
        coverage=CoverageFigures.model_validate(preview.overall, from_attributes=True),
        floors=[
            FloorCoverage(floor=floor.id, **CoverageFigures.of(covered))
            for floor, covered in zip(live.survey.floors, preview.floors, strict=True)
        ],
        requirements=[
            RequirementFigure(
                name=goal.name,
                required=goal.coverage,
                fraction_of_achievable=round(covered.fraction_of_achievable, 9),
                met=covered.meets(goal.coverage),
            )
            for goal, covered in zip(goals, preview.goals, strict=True)
        ],
        station=StationAreas(covered_area_m2=round(preview.covered_m2, 6), own_area_m2=round(preview.own_m2, 6)),
        links=[link_in_scene(link, live.survey.scene) for link in preview.links],
        n_stations=len(preview.draft.stations),
        registration=Joined(connected=registration.connected, n_networks=len(registration.networks)),
    )


def ground_head(live: LivePlan, ground: GroundMap) -> GroundHead:
    """Return the head of a map."""
    height, width = ground.values.shape
    x, y = (ground.origin_m + live.survey.scene.offset_m[:2]).tolist()
    return GroundHead(floor=ground.floor, origin=[x, y], cell_m=ground.cell_m, width=width, height=height)


def draft_route_document(figures: DraftFigures, walk: RouteResult, revision: int) -> RouteOfDraft:
    """Return the route; `figures` are of the same draft."""
    plan = replace(figures.plan, route=walk.route, field_time=walk.field_time)
    sections = {"route": route_document(plan), "field_time": walk.field_time}
    return RouteOfDraft.model_validate({"revision": revision, **sections}, from_attributes=True)


def _unseen(surface: LeftSurface, scene: Scene) -> LeftSurfaceSection:
    element = scene.elements[surface.element]
    room = None if surface.room < 0 else scene.rooms[surface.room]
    return LeftSurfaceSection(
        element=surface.element,
        name=scene.label(surface.element),
        kind=element.kind,
        source_id=element.source_id,
        room=None if room is None else RoomSection(name=room.title, source_id=room.source_id),
        floor=surface.floor,
        area_m2=surface.area_m2,
        n_pieces=surface.n_pieces,
        pieces=tuple(_piece(piece, scene.offset_m) for piece in surface.pieces),
    )


def _piece(piece: UnseenPiece, offset_m: FloatArray) -> PieceSection:
    low, high = piece.box_m
    return PieceSection(
        area_m2=piece.area_m2,
        centroid=_scene_m(piece.centroid_m, offset_m),
        box=(_scene_m(low, offset_m), _scene_m(high, offset_m)),
        patch=piece.patch,
    )


def _scene_m(local_m: FloatArray, offset_m: FloatArray) -> tuple[float, float, float]:
    """A place to the micrometre, which is finer than any of them is meant."""
    x, y, z = (round(value, 6) + 0.0 for value in (local_m + offset_m).tolist())
    return x, y, z
