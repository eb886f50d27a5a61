"""The result: stations and what they are worth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from planner_core.documents import Number, document
from planner_core.model.arrays import BoolArray, FloatArray, Int32Array, UInt8Array
from planner_core.model.planning import PlanSettings, Survey
from planner_core.model.registration import Link, Registration
from planner_core.model.requirements import PartResult, PointLimits
from planner_core.model.route import FieldTime, Route, UnreachableArea
from planner_core.model.unseen import Why
from planner_core.model.values import Count, rounded


@dataclass(frozen=True)
class Station:
    """A position of the plan. position_m : (3,) float64, local, the sensor's origin."""

    id: str
    floor: str
    order: int
    position_m: FloatArray
    instrument_height_m: float
    fixed: bool = False
    covered_area_m2: float = 0.0
    """Area this station sees by itself, as well as is required of all; on floors that are not required too."""
    own_area_m2: float = 0.0
    """Area that is required and would no longer be covered without it, as in `StationReason`."""


@dataclass(frozen=True)
class Coverage:
    """How much of a surface the plan's stations see together."""

    achievable_area_m2: float
    """Seen by at least one admissible candidate (or by a given station)."""
    total_area_m2: float
    covered_area_m2: float

    @property
    def fraction_of_achievable(self) -> float:
        """Covered / achievable; 1 where nothing is achievable."""
        return self.covered_area_m2 / self.achievable_area_m2 if self.achievable_area_m2 > 0 else 1.0

    def meets(self, required: float) -> bool:
        """Whether the fraction of achievable reaches `required`, but for rounding in the last places."""
        return self.fraction_of_achievable >= required - 1e-9

    @property
    def fraction_of_total(self) -> float:
        """Covered / total; 1 where there is no surface."""
        return self.covered_area_m2 / self.total_area_m2 if self.total_area_m2 > 0 else 1.0


@dataclass(frozen=True)
class UnseenElement:
    """Achievable surface of one element that the plan leaves unseen."""

    element: int
    floor: str
    """Floor id, or empty where the element belongs to none."""
    unseen_area_m2: float
    achievable_area_m2: float


@dataclass(frozen=True)
class PlanRoom:
    """A room with required surface: one of the source (IfcSpace), or a region of free floor, which has no name.

    floor : id, empty where its surface counts for none. label_m : (3,) float64, its roomiest place on the ground, and
    box_m : (2, 3) around the centroids of its patches; both local.
    """

    name: str
    source_id: str
    floor: str
    label_m: FloatArray
    box_m: FloatArray


@dataclass(frozen=True)
class PlanRooms:
    """Rooms, and which of them each patch belongs to. room_of_patch : (P,) int32 into `rooms`, -1 none."""

    rooms: tuple[PlanRoom, ...]
    room_of_patch: Int32Array


@dataclass(frozen=True)
class Loss:
    """What one requirement would lose if a station went. patch : (K,) int32, rising, what would no longer meet it:
    no other station, or too few, see it well enough. Only what is achievable, as only that counts as covered.
    """

    requirement: str
    patch: Int32Array
    area_m2: float
    fraction_of_achievable: float
    """Of the requirement, without the station."""
    met: bool
    """Whether the requirement would be met without it."""


@document
@dataclass(frozen=True)
class CheckedFigure:
    """A figure of a plan beside what random points say."""

    planned: Annotated[Number, Field(alias="told")]
    """Of the plan."""
    judged: Annotated[Number, rounded(9)]
    """Of the points."""
    error: Annotated[Number, rounded(9)]
    """One standard error of it."""


@document
@dataclass(frozen=True)
class CheckedLink:
    """Overlap of two stations by random points, as fractions, measured as the plan's requirements say."""

    a: str
    b: str
    overlap: CheckedFigure


@document
@dataclass(frozen=True)
class IndependentCheck:
    """Figures by random points, each checked by itself with rays of Open3D, of all requirements together."""

    n_points: Count
    engine: str
    covered_m2: CheckedFigure
    achievable_m2: CheckedFigure
    """Scannable from as many candidates and stations as are required."""
    share: CheckedFigure
    """Covered of scannable, a fraction."""
    links: tuple[CheckedLink, ...]


@dataclass(frozen=True)
class Plan:
    """The result: stations and what they are worth. Everything an export needs, apart from the scans themselves.

    times_seen : (P,) int32, number of the plan's stations that see each patch.
    achievable : (P,) bool, seen by at least one candidate or station.
    coverage_curve : covered fraction of achievable area after 1, 2, ... stations, in the order of choice.
    """

    survey: Survey
    settings: PlanSettings
    stations: tuple[Station, ...]
    times_seen: Int32Array
    achievable: BoolArray
    coverage: Coverage
    coverage_by_floor: tuple[Coverage, ...]
    coverage_curve: tuple[float, ...]
    links: tuple[Link, ...]
    connected: bool
    unseen: tuple[UnseenElement, ...]
    lower_bound: int
    n_candidates: int
    engine: str
    """Name of the engine and device that scanned, for the record."""
    objective_value: float | None = None
    """Of another objective than fewest stations: seconds in the field, or fraction of achievable area covered."""
    objective_bound: float | None = None
    """What no plan on these candidates is better than."""
    n_greedy: int | None = None
    """Stations that greedy selection takes for the same; None: not known."""
    n_bounded: int | None = None
    """Candidates that `lower_bound` holds for; the others, taken from off the grid, may do better. None: all."""
    requirements: tuple[PartResult, ...] = ()
    """The result of each requirement."""
    qualities: tuple[PointLimits, ...] = ()
    """Distinct limits required, those of all first."""
    required: BoolArray | None = None
    """(P,) bool, patches that something is required of: in scope, planned, no mere obstacle; None: all."""
    times_met: UInt8Array | None = None
    """(Q, P) uint8, candidates that meet each quality on each patch, 255 for more; None: not known."""
    registration: Registration | None = None
    """How the stations are connected; `connected` is the same in a word."""
    losses: tuple[tuple[Loss, ...], ...] = ()
    """For each station, one a requirement, in the order of `requirements`; empty: not worked out."""
    why_stopped: str = ""
    """Why the search for fewer stations ended: `proven`, `work limit` ...; empty where the method does not search."""
    route: Route | None = None
    """The route through `stations`; None: not computed."""
    field_time: FieldTime | None = None
    unreachable: tuple[UnreachableArea, ...] = ()
    """Rooms that nobody can walk into."""
    why: Why | None = None
    """What each station adds, and why the unseen stays unseen; None: not computed."""
    rooms: PlanRooms | None = None
    """Rooms of the required surface; None: not computed."""
    candidates_m: FloatArray | None = None
    """(N, 3) positions that were observed from, local; None: not kept."""
    independent_check: IndependentCheck | None = None
    """The check by random points; None: not required."""
    warnings: tuple[str, ...] = ()
    timings_s: dict[str, float] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """What the plan is worth, in a line."""
        bound = f" (lower bound {self.lower_bound})" if self.lower_bound else ""
        share, area_m2 = self.coverage.fraction_of_achievable, self.coverage.achievable_area_m2
        connected = "connected" if self.connected else "not connected"
        return f"{len(self.stations)} stations{bound}, {100 * share:.1f} % of {area_m2:.0f} m2 scannable, {connected}"
