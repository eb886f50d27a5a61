"""The site as users describe it, mappings (YAML, JSON) and station lists, read into a `Site`. Scene frame, metres.

entrances: [[1.0, 2.0, 0.0]]          # places on the ground: x, y, z
keep_out: [{name: lab, floor: F0, outline: [[0, 0], [4, 0], [4, 3], [0, 3]]}]
access: []                            # as keep_out; on their floors nobody goes anywhere else
fixed: [{id: S001, position: [3.0, 2.0, 1.6], height: 1.6, floor: F0}]      # also `locked`, `kept`, `begun`
forbidden: [{position: [5.0, 1.0, 1.6], radius: 1.0}]
robot: {radius: 0.3, step: 0.03, height: 0.6, opens_doors: false}
start: [1.0, 2.0, 0.0]
end: [8.0, 2.0, 0.0]
returns: false
ground_picks: [{point: [4.0, 2.0, 0.75], is_ground: true, floor: F0}]
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, cast

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from planner_core.documents import Entries, ShortEntries, YesNo, shown
from planner_core.errors import RequirementError
from planner_core.model import GroundPick, KeepOut, PriorStation, Role, Site
from planner_core.positions.outlines import checked_outline

#: Each takes a look at the whole mesh.
_MOST_PICKS = 1000


# ------------------------------------------------------------------------------------------------ values
def _numbers(value: Any, names: str) -> tuple[float, ...]:
    n = names.count(",") + 1
    parts = value.tolist() if isinstance(value, np.ndarray) else value
    if isinstance(parts, (str, bytes)) or not isinstance(parts, Sequence) or len(parts) != n:
        raise RequirementError(f"got {shown(value)}, expected {n} numbers: {names} in metres, scene frame")
    if not all(_is_number(part) for part in parts):
        raise RequirementError(f"got {shown(value)}, expected {n} finite numbers: {names} in metres, scene frame")
    return tuple(float(part) for part in parts)


def _place(value: Any) -> tuple[float, float, float]:
    return cast("tuple[float, float, float]", _numbers(value, "x, y, z"))


def _length(value: Any) -> float:
    if not _is_number(value) or value < 0:
        raise RequirementError(f"got {shown(value)}, expected a number of metres, 0 or more; see docs/howto/site.md")
    return float(value)


def _is_number(value: Any) -> bool:
    is_one = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    return is_one and math.isfinite(value)


def _text(value: Any) -> str:
    """A name, which may be a number; empty where it is left out or null."""
    return "" if value is None else str(value).strip()


_Place = Annotated[tuple[float, float, float], BeforeValidator(_place)]
_Corner = Annotated[tuple[float, float], BeforeValidator(lambda value: _numbers(value, "x, y"))]
_Outline = Annotated[tuple[_Corner, ...], AfterValidator(checked_outline)]
_Metres = Annotated[float, BeforeValidator(_length), Field(ge=0)]
_Text = Annotated[str, BeforeValidator(_text, json_schema_input_type=str | float | None)]


# ----------------------------------------------------------------------------------------------- entries
class AreaEntry(ShortEntries):
    """Corners of an area, or these with its floor."""

    outline: _Outline
    name: _Text = ""
    floor: _Text = ""


class PlaceEntry(ShortEntries):
    """The sensor's origin, or this with its floor."""

    position: _Place
    id: _Text = ""
    floor: _Text = ""


class StationEntry(PlaceEntry):
    """A station given before planning."""

    height: _Metres | None = None
    """Of the sensor above the ground."""


class ForbiddenEntry(PlaceEntry):
    """A place that no station may be near."""

    radius: _Metres = PriorStation.radius_m


class PickEntry(ShortEntries):
    """A point of a surface that is ground, or is not."""

    point: _Place
    is_ground: YesNo | None = None
    floor: _Text = ""
    """Empty: the nearest."""


class RobotEntry(Entries):
    """Who carries the scanner, where that is no person."""

    radius: _Metres | None = None
    step: _Metres | None = None
    height: _Metres | None = None
    opens_doors: YesNo | None = None


class SiteEntries(Entries):
    """Entrances, areas nobody enters, stations given before planning, surfaces marked as ground."""

    entrances: tuple[_Place, ...] | None = None
    """Places on the ground."""
    keep_out: tuple[AreaEntry, ...] | None = None
    access: tuple[AreaEntry, ...] | None = None
    """As keep_out; on their floors nobody goes anywhere else."""
    fixed: tuple[StationEntry, ...] | None = None
    """As scanned."""
    scanned: tuple[StationEntry, ...] | None = None
    locked: tuple[StationEntry, ...] | None = None
    kept: tuple[StationEntry, ...] | None = None
    begun: tuple[StationEntry, ...] | None = None
    forbidden: tuple[ForbiddenEntry, ...] | None = None
    robot: RobotEntry | None = None
    start: _Place | None = None
    end: _Place | None = None
    returns: YesNo | None = None
    ground_picks: Annotated[tuple[PickEntry, ...], Field(max_length=_MOST_PICKS)] | None = None

    def site(self) -> Site:
        """Return the site that they say.

        Raises
        ------
        RequirementError
            Two stations of one id.
        """
        robot = self.robot or RobotEntry()
        prior = [s for key in ("fixed", *Role) for s in _prior(key, getattr(self, key) or ())]
        check_ids(prior)
        return Site(
            entrances_m=self.entrances or (),
            keep_out=(*_areas("keep_out", self.keep_out), *_areas("access", self.access)),
            prior=tuple(prior),
            carrier_radius_m=robot.radius,
            step_m=robot.step,
            carrier_height_m=robot.height,
            opens_doors=robot.opens_doors is not False,
            start_m=self.start,
            end_m=self.end,
            returns=self.returns is True,
            ground_picks=tuple(
                GroundPick(pick.point, pick.is_ground is not False, pick.floor) for pick in self.ground_picks or ()
            ),
        )


def _areas(key: str, areas: tuple[AreaEntry, ...] | None) -> Iterator[KeepOut]:
    for number, area in enumerate(areas or ()):
        yield KeepOut(area.outline, area.floor, key == "access", area.name or f"site.{key}[{number}]")


def _prior(key: str, stations: tuple[StationEntry | ForbiddenEntry, ...]) -> Iterator[PriorStation]:
    for number, station in enumerate(stations, start=1):
        yield PriorStation(
            id=station.id or f"{key}-{number}",
            position_m=station.position,
            role=Role.SCANNED if key == "fixed" else Role(key),
            floor=station.floor,
            instrument_height_m=station.height if isinstance(station, StationEntry) else None,
            radius_m=station.radius if isinstance(station, ForbiddenEntry) else PriorStation.radius_m,
        )


# ------------------------------------------------------------------------------------------------- lists
def prior_from(
    given: Iterable[tuple[str, Sequence[float], str | None, float | None]], role: Role, *, radius_m: float = 0.5
) -> tuple[PriorStation, ...]:
    """Give stations of a list a role.

    Parameters
    ----------
    given
        (id, position, floor, instrument height): the sensor's origin, scene frame; floor and height may be None.
    radius_m
        Of forbidden places.

    Raises
    ------
    RequirementError
        Positions that are not three finite numbers, a height or radius below zero, an id twice.
    """
    prior = []
    for number, (name, position, floor, height_m) in enumerate(given, start=1):
        try:
            station = PriorStation(
                id=name or f"{'fixed' if role == Role.SCANNED else role}-{number}",
                position_m=_place(position),
                role=role,
                floor=floor or "",
                instrument_height_m=None if height_m is None else _length(height_m),
                radius_m=_length(radius_m),
            )
        except RequirementError as error:
            raise RequirementError(f"{role} station {name or number}: {error}") from error
        prior.append(station)
    check_ids(prior)
    return tuple(prior)


def check_ids(prior: Sequence[PriorStation]) -> None:
    """A prior station has an id of its own; places where none may stand do not need any."""
    seen: set[str] = set()
    for station in prior:
        if station.role == Role.FORBIDDEN:
            continue
        if station.id in seen:
            raise RequirementError(f"stations: got the id {station.id!r} twice, expected each once; rename or drop one")
        seen.add(station.id)
