"""The site: who carries the scanner, where they come in and may go, and which stations are given beforehand.

SCENE frame, metres: the user's entries. Stages bring it to the local frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from pydantic import ConfigDict, Field, with_config

from planner_core.documents import YesNo
from planner_core.errors import RequirementError
from planner_core.model.choices import Role, one_of

FARTHEST_M = 1e7
"""The Earth's quarter: every national grid lies within, and float64 still resolves a micrometre."""
NO_OTHER_KEYS = ConfigDict(extra="forbid")
"""Of what is sent: keys that are not known are refused, so that none is lost silently."""

Metres = Annotated[float, Field(strict=True, ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Point = Annotated[tuple[Metres, Metres, Metres], Field(description="x, y, z: scene frame, metres.")]
AnyFloor = Annotated[str, Field(max_length=200, description="Id of a floor of the plan; empty: all floors.")]


@dataclass(frozen=True)
class KeepOut:
    """An area where nobody goes, or, with `access`, the only one on its floor where somebody does.

    outline_m : corners (x, y) of a simple polygon, scene frame. floor : id or name; empty: all floors.
    """

    outline_m: tuple[tuple[float, float], ...]
    floor: str = ""
    access: bool = False
    name: str = ""


@dataclass(frozen=True)
class PriorStation:
    """A station, or a forbidden position, given before planning. position_m : the sensor's origin, scene frame."""

    id: str
    position_m: tuple[float, float, float]
    role: Role
    floor: str = ""
    instrument_height_m: float | None = None
    radius_m: float = 0.5
    """Of a forbidden place."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "role", one_of(Role, self.role, "role"))


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class GroundPick:
    """A surface that somebody marked as ground, or unmarked: the coplanar region around a point on it.

    point_m : on the surface, scene frame. floor : id or name; empty: the floor nearest in height, or a new one where
    none is within reach. docs/method/floor-picking.md defines how far the region goes.
    """

    point_m: Point
    is_ground: YesNo = True
    floor: AnyFloor = ""


@dataclass(frozen=True)
class Site:
    """entrances_m : places on the ground (x, y, z), scene frame; empty: each floor's largest spaces have one.

    mover_radius_m, step_m : of who carries the scanner; None: of a person, see `planner_core.positions.local_site`.
    """

    entrances_m: tuple[tuple[float, float, float], ...] = ()
    keep_out: tuple[KeepOut, ...] = ()
    prior: tuple[PriorStation, ...] = ()
    mover_radius_m: float | None = None
    step_m: float | None = None
    mover_height_m: float | None = None
    opens_doors: bool = True
    start_m: tuple[float, float, float] | None = None
    """Where the route of the day begins; None: at the first entrance, else where it is shortest."""
    end_m: tuple[float, float, float] | None = None
    returns: bool = False
    """The route ends where it began."""
    ground_picks: tuple[GroundPick, ...] = ()
    """In the order they were made: a later one has the last word."""

    def entered_at(self, places_m: tuple[tuple[float, float, float], ...]) -> Site:
        """Return the site with entrances before its own: the route begins at the first of them. Without: as it is."""
        if not places_m:
            return self
        return replace(self, entrances_m=(*places_m, *self.entrances_m), start_m=None)

    @property
    def scanned(self) -> frozenset[str]:
        """Ids of stations whose scans exist."""
        return frozenset(station.id for station in self.prior if station.role == Role.SCANNED)

    def __post_init__(self) -> None:
        if self.returns and self.end_m is not None:
            raise RequirementError(
                f"end of the route: got {self.end_m} for a route that returns, expected one of the two; leave `end` or "
                "`returns` out"
            )
