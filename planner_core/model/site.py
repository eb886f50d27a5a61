"""The site: who carries the scanner, where they come in and may go, and which stations are given beforehand.

SCENE frame, metres: the user's entries. Stages bring it to the local frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    WithJsonSchema,
    field_serializer,
    with_config,
)
from pydantic_core import CoreSchema, core_schema

from planner_core.documents import Document, Number, YesNo, document
from planner_core.errors import RequirementError
from planner_core.model.choices import Role, one_of
from planner_core.model.values import Corner, RoleWord
from planner_core.model.values import Point as ScenePoint

FARTHEST_M = 1e7
"""The Earth's quarter: every national grid lies within, and float64 still resolves a micrometre."""
FORBIDDEN_RADIUS_M = 0.5
NO_OTHER_KEYS = ConfigDict(extra="forbid")
"""Of what is sent: keys that are not known are refused, so that none is lost silently."""

Metres = Annotated[float, Field(strict=True, ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Point = Annotated[tuple[Metres, Metres, Metres], Field(description="x, y, z: scene frame, metres.")]
AnyFloor = Annotated[str, Field(max_length=200, description="Id of a floor of the plan; empty: all floors.")]


@document
@dataclass(frozen=True)
class KeepOut:
    """An area where nobody goes, or, with `access`, the only one on its floor where somebody does."""

    outline_m: Annotated[tuple[Corner, ...], Field(alias="outline")]
    """Corners (x, y) of a simple polygon, scene coordinates."""
    floor: str = ""
    """Id or name; empty: all floors."""
    access: YesNo = False
    name: str = ""


@document
@dataclass(frozen=True)
class PriorStation:
    """A station, or a forbidden position, given before planning."""

    id: str
    position_m: Annotated[ScenePoint, Field(alias="position")]
    """The sensor's origin."""
    role: RoleWord
    floor: str = ""
    instrument_height_m: Number | None = None
    radius_m: Annotated[
        Number,
        BeforeValidator(lambda value: FORBIDDEN_RADIUS_M if value is None else value),
        WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "null"}]}),
    ] = FORBIDDEN_RADIUS_M
    """Of a forbidden place."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "role", one_of(Role, self.role, "role"))

    @field_serializer("radius_m")
    def _of_forbidden(self, value: float) -> float | None:
        return value if self.role == Role.FORBIDDEN else None


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


class PickSection(Document):
    """A surface marked as ground, or unmarked: the coplanar region around a point."""

    point: ScenePoint
    is_ground: YesNo
    floor: str
    """Id or name; empty: the nearest."""


class _AsSection:
    """Ground picks of plan.json are `PickSection`s: reviews have other keys, and refuse those that they don't know."""

    @classmethod
    def __get_pydantic_core_schema__(cls, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(
            lambda read: GroundPick(read.point, read.is_ground, read.floor),
            handler.generate_schema(PickSection),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda pick: PickSection(point=pick.point_m, is_ground=pick.is_ground, floor=pick.floor).model_dump()
            ),
        )


@document
@dataclass(frozen=True)
class Site:
    """Where the crew may go, and stations given before planning."""

    entrances_m: Annotated[tuple[ScenePoint, ...], Field(alias="entrances")] = ()
    """Places on the ground; empty: each floor's largest spaces have one."""
    keep_out: tuple[KeepOut, ...] = ()
    prior: Annotated[tuple[PriorStation, ...], Field(alias="settled")] = ()
    carrier_radius_m: Annotated[Number | None, Field(alias="mover_radius_m")] = None
    """Of who carries the scanner; None, as of the next two: of a person."""
    step_m: Number | None = None
    carrier_height_m: Annotated[Number | None, Field(alias="mover_height_m")] = None
    opens_doors: YesNo = True
    start_m: Annotated[ScenePoint | None, Field(alias="start")] = None
    """Where the route of the day begins; None: at the first entrance, else where it is shortest."""
    end_m: Annotated[ScenePoint | None, Field(alias="end")] = None
    returns: YesNo = False
    """The route ends where it began."""
    ground_picks: tuple[Annotated[GroundPick, _AsSection], ...] = ()
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
