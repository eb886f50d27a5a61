"""Results in plan.json: floors, stations, coverage, bound, network, route, the unseen and why."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from planner_core.documents import Document, Number, Whole, YesNo, words_of
from planner_core.errors import PlanFolderError
from planner_core.model import Link, PreAlignment
from planner_core.model.registration import NetworkJoin
from planner_core.model.values import (
    Area,
    Corner,
    Count,
    ElementNumber,
    FloorId,
    Metres,
    Point,
    Reason,
    Rectangle,
    Required,
    Seconds,
    Share,
    Strength,
    Text,
    rounded,
)


def _pair(link: Any) -> Any:
    return (link.a, link.b) if isinstance(link, Link) else link


Pair = Annotated[tuple[str, str], BeforeValidator(_pair)]


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
    origin: Literal["slab", "surface", "storey-elevation", "wall-foot", "marked"]
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


class LossSection(Document):
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
    """Seen from here, as well as is required of all; floors that are not required count too."""
    own_area_m2: Area
    """What is required and would no longer be covered without this station; of floors not required, nothing."""
    lost_area_m2: Area | None = None
    """Achievable surface on which some requirement would no longer be met without it; null: not worked out."""
    losses: tuple[LossSection, ...] | None = None
    """By requirement, of those that would lose something."""


class ObstacleSection(Document):
    """Surface of which nothing is required: it hides what lies behind it, and counts nowhere."""

    name: str
    """Of the part of `requirements.parts` that requires it."""
    area_m2: Area
    """In scope."""


class LeftOutSection(Document):
    """Elements that were left out of the scene."""

    name: str
    """Class or pattern, as given."""
    area_m2: Area


class ScopeSection(Document):
    """What the figures are about."""

    kind: Literal["interior", "exterior", "all"]
    """What was planned; `auto` of the requirements is interior where the building has an inside, else all."""
    in_scope_area_m2: Area
    """Obstacles among it."""
    out_of_scope_area_m2: Area
    obstacles: tuple[ObstacleSection, ...] = ()
    left_out: tuple[LeftOutSection, ...] = ()


class CoverageFigures(Document):
    """Coverage of surface."""

    achievable_area_m2: Area
    """Seen by at least one admissible candidate or by a station of the plan."""
    total_area_m2: Area
    """All surface of the model that counts here, the inside of walls included."""
    covered_area_m2: Area
    """Seen by at least one station of the plan."""
    fraction_of_achievable: Share
    """covered / scannable."""
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
    gap: Annotated[Number, Field(le=1.0), rounded(9)] | None
    """(stations - lower_bound) / stations; null where no bound is known, or where coverage misses the requirement."""
    proven: YesNo
    """This plan meets the required coverage, and no plan on these candidates that does has fewer stations."""
    why_stopped: str = ""
    """Why the search for fewer stations ended: proven, work limit, time limit, interrupted, earlier stations kept;
    empty where the method does not search."""
    n_candidates_bounded: Count | None = None
    """Candidates that the lower bound holds for: grid, doorways, rooms, landings, given stations, in the connected
    components that the plan is made in. Positions off the grid may do better than the bound."""
    greedy_stations: Count | None = None
    """Stations that greedy selection takes for the same; null: not known."""
    value: Number | None = None
    """Of another objective than fewest stations: seconds in the field, or fraction of the scannable area covered."""
    bound: Number | None = None
    """What no plan on these candidates is better than, in the same unit."""


class NetworkSection(Document):
    """Stations that links join."""

    stations: tuple[str, ...]
    floors: tuple[str, ...]
    n_links: Count
    bridges: tuple[Pair, ...]
    """Links without which it falls apart."""
    articulations: tuple[str, ...]
    """Stations without which the others fall apart."""
    bottleneck: Link | None
    """Weakest link that some pair of stations relies on: the nearest to what is required."""
    two_connected: YesNo


class GapSection(Document):
    """Two networks, by their places in the list, and the link between them that comes nearest to counting."""

    networks: tuple[Count, ...]
    best: Link
    targets_m: Annotated[tuple[Point, ...], Field(alias="targets")] = ()
    """Places for three targets that both stations of the link see, to register the networks by; empty: none found."""


class RegistrationSection(Document):
    """Links between stations, and what they join."""

    threshold: Required
    """Minimum overlap of a link; 0: not required."""
    min_strength: Strength = 0.0
    """Strength from which on a link counts."""
    min_probability: Share = 0.0
    """Probability to register from which on a link counts; 0: not required."""
    pre_alignment: Annotated[PreAlignment, words_of(PreAlignment)] = PreAlignment.MANUAL
    """Where registration starts, of links' probabilities."""
    doors_change: YesNo = False
    """Links count with open doors shut, too."""
    connected: YesNo
    """Links that count join all stations."""
    links: tuple[Link, ...]
    networks: tuple[NetworkSection, ...] = ()
    """Largest first."""
    floor_joins: tuple[Pair, ...] = ()
    """Links that count, between stations of different floors."""
    gaps: tuple[GapSection, ...] = ()
    doors_needed: tuple[str, ...] = ()
    """Ids of open doors without which there are more networks."""
    joins: tuple[NetworkJoin, ...] = ()
    """Stations that are there for the network alone, and what they join; plans of older versions have none."""


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


class FieldTimeSection(Document):
    """Seconds in the field."""

    scanning_s: Seconds | None
    """null where the duration of a scan is not known."""
    set_up_s: Seconds
    """Of all stations."""
    walking_s: Seconds
    """Along the legs that can be walked."""
    total_s: Seconds | None
    """The sum; null where a part is not known."""


class UnreachableSection(Document):
    """A room that no entrance leads to; nothing is planned in it."""

    floor: FloorId
    area_m2: Area
    """Ground that a person could stand on."""
    inside: Point
    """A place in it, on the ground."""
    rectangles: tuple[Rectangle, ...] = ()
    """Its ground in plan: no two share more than an edge. Plans of older versions have none."""


class UnseenSection(Document):
    """Achievable surface of an element that the plan leaves unseen."""

    element: ElementNumber
    name: str
    """With its file in brackets, where the scene is several files."""
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


class StepSection(Document):
    """Coverage after one station more."""

    station: str
    covered_area_m2: Area
    fraction_of_achievable: Share | None


class PieceSection(Document):
    """Surface that is connected."""

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
