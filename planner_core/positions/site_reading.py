"""What users say of the site, as mappings (YAML, JSON) and station lists, read into a `Site`. Scene frame, metres.

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
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, cast

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import GroundPick, KeepOut, Role, SettledStation, Site
from planner_core.positions.outlines import LEAST_AREA_M2, area_of_outline_m2, crossing_sides

#: Key of a list of stations, and the role it gives them.
_ROLE_OF_KEY = {
    "fixed": Role.SCANNED,
    "scanned": Role.SCANNED,
    "locked": Role.LOCKED,
    "kept": Role.KEPT,
    "begun": Role.BEGUN,
    "forbidden": Role.FORBIDDEN,
}
_SITE_KEYS = ("entrances", "keep_out", "access", *_ROLE_OF_KEY, "robot", "start", "end", "returns", "ground_picks")
#: As many as a zone of a requirements file may have.
_MOST_CORNERS = 10_000
#: Each takes a look at the whole mesh.
_MOST_PICKS = 1000
_Place = tuple[float, float, float]


def site_from_mapping(mapping: Mapping[str, Any]) -> Site:
    """Read a site as this module's head shows it; every key may be left out.

    Raises
    ------
    RequirementError
        Unknown keys, places that are not three numbers, outlines that cross themselves, enclose nothing, have a corner
        twice, fewer than three or more than 10 000, two stations of one id.
    """
    site = _mapping("site", mapping, _SITE_KEYS)
    robot = _mapping("site.robot", site.get("robot") or {}, ("radius", "step", "height", "opens_doors"))
    settled = [s for key, role in _ROLE_OF_KEY.items() for s in _stations(f"site.{key}", site.get(key), role)]
    check_ids(settled)
    return Site(
        entrances_m=tuple(_place(f"site.entrances[{i}]", p) for i, p in _each("site.entrances", site.get("entrances"))),
        keep_out=(
            *_outlines("site.keep_out", site.get("keep_out"), access=False),
            *_outlines("site.access", site.get("access"), access=True),
        ),
        settled=tuple(settled),
        mover_radius_m=_length("site.robot.radius", robot.get("radius")),
        step_m=_length("site.robot.step", robot.get("step")),
        mover_height_m=_length("site.robot.height", robot.get("height")),
        opens_doors=_yes_or_no("site.robot.opens_doors", robot.get("opens_doors"), default=True),
        start_m=None if site.get("start") is None else _place("site.start", site["start"]),
        end_m=None if site.get("end") is None else _place("site.end", site["end"]),
        returns=_yes_or_no("site.returns", site.get("returns"), default=False),
        ground_picks=tuple(_ground_picks("site.ground_picks", site.get("ground_picks"))),
    )


def settled_from(
    given: Iterable[tuple[str, Sequence[float], str | None, float | None]], role: Role, *, radius_m: float = 0.5
) -> tuple[SettledStation, ...]:
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
    settled = []
    for number, (name, position, floor, height_m) in enumerate(given, start=1):
        told = f"{role} station {name or number}"
        height = _length(f"{told}'s instrument height", height_m)
        radius = _length(f"{told}'s radius", radius_m)
        settled.append(
            SettledStation(
                id=name or f"{'fixed' if role == Role.SCANNED else role}-{number}",
                position_m=_place(told, position),
                role=role,
                floor=floor or "",
                instrument_height_m=height,
                radius_m=SettledStation.radius_m if radius is None else radius,
            )
        )
    check_ids(settled)
    return tuple(settled)


def _stations(key: str, value: Any, role: Role) -> tuple[SettledStation, ...]:
    out: list[SettledStation] = []
    for number, item in _each(key, value):
        title = f"{key}[{number}]"
        if not isinstance(item, Mapping):
            item = {"position": item}
        names = ("id", "position", "floor", *(("radius",) if role == Role.FORBIDDEN else ("height",)))
        told = _mapping(title, item, names)
        if "position" not in told:
            raise RequirementError(f"{title}: got no position, expected [x, y, z] of the sensor in the scene frame")
        out += settled_from(
            [
                (
                    _text(told.get("id")) or f"{key.rpartition('.')[2]}-{number + 1}",
                    _place(title, told["position"]),
                    _text(told.get("floor")),
                    _length(f"{title}.height", told.get("height")),
                )
            ],
            role,
            radius_m=_length(f"{title}.radius", told.get("radius", SettledStation.radius_m)) or 0.0,
        )
    return tuple(out)


def _ground_picks(key: str, value: Any) -> Iterable[GroundPick]:
    given = _each(key, value)
    if len(given) > _MOST_PICKS:
        raise RequirementError(f"{key}: got {len(given)} of them, expected at most {_MOST_PICKS}; take some out")
    for number, item in given:
        title = f"{key}[{number}]"
        told = _mapping(title, item if isinstance(item, Mapping) else {"point": item}, ("point", "is_ground", "floor"))
        if "point" not in told:
            raise RequirementError(f"{title}: got no point, expected [x, y, z] on the surface in the scene frame")
        yield GroundPick(
            point_m=_place(title, told["point"]),
            is_ground=_yes_or_no(f"{title}.is_ground", told.get("is_ground"), default=True),
            floor=_text(told.get("floor")),
        )


def check_ids(settled: Sequence[SettledStation]) -> None:
    """A settled station has an id of its own; places where none may stand do not need any."""
    seen: set[str] = set()
    for station in settled:
        if station.role == Role.FORBIDDEN:
            continue
        if station.id in seen:
            raise RequirementError(
                f"settled stations: got the id {station.id!r} twice, expected each once; rename or drop one"
            )
        seen.add(station.id)


def _outlines(key: str, value: Any, *, access: bool) -> tuple[KeepOut, ...]:
    out = []
    for number, item in _each(key, value):
        title = f"{key}[{number}]"
        told = _mapping(title, item if isinstance(item, Mapping) else {"outline": item}, ("name", "floor", "outline"))
        out.append(
            KeepOut(
                outline_m=_outline(title, told.get("outline")),
                floor=_text(told.get("floor")),
                access=access,
                name=_text(told.get("name")) or title,
            )
        )
    return tuple(out)


def _outline(title: str, value: Any) -> tuple[tuple[float, float], ...]:
    given = _each(f"{title}.outline", value)
    if len(given) > _MOST_CORNERS:
        raise RequirementError(
            f"{title}: got an outline of {len(given)} corners, expected at most {_MOST_CORNERS}; simplify it"
        )
    corners = [_numbers(f"{title}, corner {i + 1}", corner, 2) for i, corner in given]
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners.pop()
    if len(corners) < 3:
        raise RequirementError(f"{title}: got an outline of {len(corners)} corners, expected [x, y] of three or more")
    _check_shape(title, corners)
    return cast("tuple[tuple[float, float], ...]", tuple(corners))


def _check_shape(title: str, corners: list[tuple[float, ...]]) -> None:
    """Refuse an outline that does not say what is inside."""
    seen: dict[tuple[float, ...], int] = {}
    for number, corner in enumerate(corners, start=1):
        if corner in seen:
            raise RequirementError(
                f"{title}: got corner {number} where corner {seen[corner]} is, expected corners that all differ; take "
                "one of them out"
            )
        seen[corner] = number
    outline_m = np.array(corners)
    if crossing := crossing_sides(outline_m):
        raise RequirementError(
            f"{title}: got an outline that crosses itself, its sides {crossing[0] + 1} and {crossing[1] + 1}, expected "
            "its corners in order, one way"
        )
    if area_of_outline_m2(outline_m) < LEAST_AREA_M2:
        raise RequirementError(
            f"{title}: got an outline without area, expected its corners around some ground; give them in metres"
        )


# ---------------------------------------------------------------------------------------------- values
def _mapping(title: str, value: Any, known: Sequence[str]) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise RequirementError(f"{title}: got {_shown(value)}, expected keys of {', '.join(known)}")
    for key in value:
        if key not in known:
            near = get_close_matches(str(key), known, n=1)
            hint = f"perhaps {near[0]}" if near else f"expected one of {', '.join(known)}"
            raise RequirementError(f"{title}: got the key {_shown(key)}, which it does not have; {hint}")
    return value


def _each(key: str, value: Any) -> list[tuple[int, Any]]:
    """Entries of a list with their numbers; none where it is left out."""
    if value is None:
        return []
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Sequence):
        raise RequirementError(f"{key}: got {_shown(value)}, expected a list in square brackets")
    return list(enumerate(value))


def _place(title: str, value: Any) -> _Place:
    return cast("_Place", _numbers(title, value, 3))


def _numbers(title: str, value: Any, n: int) -> tuple[float, ...]:
    names = ("x, y, z" if n == 3 else "x, y") + " in metres, scene frame"
    parts = value.tolist() if isinstance(value, np.ndarray) else value
    if isinstance(parts, (str, bytes)) or not isinstance(parts, Sequence) or len(parts) != n:
        raise RequirementError(f"{title}: got {_shown(value)}, expected {n} numbers: {names}")
    if not all(_is_number(part) for part in parts):
        raise RequirementError(f"{title}: got {_shown(value)}, expected {n} finite numbers: {names}")
    return tuple(float(part) for part in parts)


def _text(value: Any) -> str:
    """A name, which may be a number; empty where it is left out or null."""
    return "" if value is None else str(value).strip()


def _length(title: str, value: Any) -> float | None:
    if value is None:
        return None
    if not _is_number(value) or value < 0:
        raise RequirementError(f"{title}: got {_shown(value)}, expected a number of metres, 0 or more")
    return float(value)


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float, np.integer, np.floating))
        and not isinstance(value, bool)
        and math.isfinite(value)
    )


def _yes_or_no(title: str, value: Any, *, default: bool) -> bool:
    if value is None:
        return default
    if not isinstance(value, bool):
        raise RequirementError(f"{title}: got {_shown(value)}, expected true or false")
    return value


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
