"""Reading a review out of its layer: text of `review.usda`, PlanUnderReview -> Review.

The layer is local, the review in the scene frame. Where another program moved a station of the plan, by its transform,
or switched it off, that counts as a reviewer's edit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, TypeVar

from planner_core.errors import ReviewError
from planner_core.model.review import (
    Comment,
    Entrance,
    ForbiddenPlace,
    LastChange,
    PlanUnderReview,
    Review,
    ReviewedStation,
    SignOff,
    StationEdit,
    StationProgress,
    Verdict,
    Zone,
    check_door_state,
    check_id,
    check_line,
)
from planner_core.model.site import GroundPick, Point
from planner_core.plan_folder.sdf_authoring import Layer, Tf
from planner_core.plan_folder.usd_names import prim_names_of_ids
from planner_core.review import usd
from planner_core.review.rules import rounded_height_m, rounded_m

_Read = TypeVar("_Read")
_MISSING: Any = object()


def read_review(text: str, plan: PlanUnderReview, *, name: str = "review.usda") -> Review:
    """Read the review of `plan` from a layer's text; `name` is the file's in messages.

    Raises
    ------
    PlanFolderError
        It is no USD, or an attribute of ours is of another type or value than we write; the prim is named.
    """
    return _Reader(usd.layer_of(text, name), plan, name).review()


class _Reader:
    """Reads one layer."""

    def __init__(self, layer: Layer, plan: PlanUnderReview, name: str) -> None:
        self._layer = layer
        self._plan = plan
        self._name = name

    def review(self) -> Review:
        """Read everything."""
        root = self._layer.GetPrimAtPath(usd.REVIEW)
        signed = self._layer.GetPrimAtPath(usd.SIGN_OFF)
        return Review(
            revision=0 if root is None else self._read(root, self._revision),
            stations=self._stations(),
            forbidden=self._all_of(usd.FORBIDDEN, self._place),
            zones=self._all_of(usd.ZONES, self._zone),
            ground_picks=self._all_of(usd.PICKS, self._pick),
            entrances=self._all_of(usd.ENTRANCES, self._entrance),
            doors=dict(self._read(prim, self._door) for prim in self._ours(usd.DOORS)),
            comments=self._all_of(usd.COMMENTS, self._comment),
            verdicts=dict(self._read(prim, self._verdict) for prim in self._ours(usd.VERDICTS)),
            progress=dict(self._read(prim, self._progress) for prim in self._ours(usd.PROGRESS)),
            sign_off=None if signed is None else self._read(signed, self._sign_off),
            touched={} if root is None else self._read(root, self._touched),
        )

    def _read(self, prim: Any, read_one: Callable[[Any], _Read]) -> _Read:
        try:
            return read_one(prim)
        # Attributes that somebody wrote by hand may be of any type.
        except (ReviewError, TypeError, ValueError, AttributeError, IndexError, Tf.ErrorException) as error:
            problem = " ".join(str(error).split())
            raise usd.damaged(self._name, f"{prim.path}: {problem}") from error

    def _ours(self, path: str) -> Iterator[Any]:
        """Prims below `path` that bear one of our attributes; others are somebody else's."""
        parent = self._layer.GetPrimAtPath(path)
        for prim in () if parent is None else parent.nameChildren:
            if any(attribute.name.startswith(usd.PREFIX) for attribute in prim.attributes):
                yield prim

    def _all_of(self, path: str, read_one: Callable[[Any], _Read]) -> dict[str, _Read]:
        return {prim.name: self._read(prim, read_one) for prim in self._ours(path)}

    def _revision(self, prim: Any) -> int:
        schema = _text(prim, "schema", usd.SCHEMA)
        if schema != usd.SCHEMA:
            raise ReviewError(f"schema is {schema!r}, expected {usd.SCHEMA!r} (another version of tlsplan wrote it)")
        return _whole(prim, "revision", 0)

    def _touched(self, prim: Any) -> dict[str, LastChange]:
        names, revisions, people, times = (
            list(usd.value_of(prim, f"{usd.PREFIX}touched{what}") or ()) for what in ("", "Revisions", "By", "At")
        )
        if not len(names) == len(revisions) == len(people) == len(times):
            raise ReviewError("the lists of what was touched differ in length, expected one entry per object in each")
        rows = zip(names, revisions, people, times, strict=True)
        return {str(name): LastChange(int(revision), str(by), str(at)) for name, revision, by, at in rows}

    # -------------------------------------------------------------------------------------------- stations
    def _stations(self) -> dict[str, StationEdit]:
        edits = {}
        names = prim_names_of_ids([station.id for station in self._plan.stations])
        for name, station in zip(names, self._plan.stations, strict=True):
            prim = self._layer.GetPrimAtPath(f"{usd.STATIONS}/{name}")
            if prim is not None:
                edit = self._read(prim, partial(self._edit, station=station))
                if edit != StationEdit():
                    edits[station.id] = edit
        for prim in self._ours(usd.STATIONS):
            if prim.name not in names and _yes(prim, "added", otherwise=False):
                edits[prim.name] = self._read(prim, self._added)
        return edits

    def _edit(self, prim: Any, station: ReviewedStation) -> StationEdit:
        position_m = self._position(prim)
        height_m, floor = usd.value_of(prim, usd.HEIGHT), usd.value_of(prim, usd.FLOOR)
        moved = position_m is not None
        return StationEdit(
            position_m=position_m,
            instrument_height_m=_height(height_m, otherwise=station.instrument_height_m) if moved else None,
            floor=(station.floor if floor is None else str(floor)) if moved else None,
            removed=prim.HasInfo("active") and not prim.active,
            locked=_yes(prim, "locked", otherwise=None),
        )

    def _added(self, prim: Any) -> StationEdit:
        check_id(prim.name)
        return StationEdit(
            position_m=self._position(prim),
            instrument_height_m=_height(usd.value_of(prim, usd.HEIGHT), otherwise=None),
            floor=str(usd.value_of(prim, usd.FLOOR) or ""),
            added=True,
            locked=_yes(prim, "locked", otherwise=None),
        )

    def _position(self, prim: Any) -> Point | None:
        matrix = usd.value_of(prim, usd.TRANSFORM)
        return None if matrix is None else self._scene_m(matrix.ExtractTranslation())

    def _scene_m(self, local_m: Any) -> Point:
        x, y, z = (float(a) + b for a, b in zip(local_m, self._plan.offset_m, strict=True))
        return rounded_m("position", (x, y, z))

    def _placed(self, prim: Any) -> Point:
        position_m = self._position(prim)
        if position_m is None:
            raise ReviewError(f"has no {usd.TRANSFORM}, expected its position")
        return position_m

    # -------------------------------------------------------------------------------------------- all else
    def _place(self, prim: Any) -> ForbiddenPlace:
        radius_m = usd.value_of(prim, "radius")
        if not isinstance(radius_m, float):
            raise ReviewError(f"radius is {radius_m!r}, expected metres")
        return ForbiddenPlace(prim.name, self._placed(prim), round(radius_m, 6), _text(prim, "floor", ""))

    def _zone(self, prim: Any) -> Zone:
        corners = usd.value_of(prim, f"{usd.PREFIX}outline")
        places = [self._scene_m((corner[0], corner[1], 0.0)) for corner in corners or ()]
        coverage = usd.value_of(prim, f"{usd.PREFIX}coverage")
        return Zone(
            id=prim.name,
            kind=_text(prim, "kind"),
            outline_m=tuple((x, y) for x, y, _ in places),
            floor=_text(prim, "floor", ""),
            name=_text(prim, "name", ""),
            coverage=None if coverage is None else float(coverage),
        )

    def _pick(self, prim: Any) -> GroundPick:
        check_id(prim.name)
        is_ground = _yes(prim, "isGround", otherwise=None)
        if is_ground is None:
            raise ReviewError("isGround is missing, expected true or false")
        return GroundPick(point_m=self._placed(prim), is_ground=is_ground, floor=_text(prim, "floor", ""))

    def _entrance(self, prim: Any) -> Entrance:
        return Entrance(prim.name, self._placed(prim), _text(prim, "floor"))

    def _door(self, prim: Any) -> tuple[str, str]:
        door, state = _text(prim, "element"), _text(prim, "state")
        check_line("door", door)
        check_door_state(state)
        return door, state

    def _comment(self, prim: Any) -> Comment:
        station, element = usd.value_of(prim, f"{usd.PREFIX}station"), usd.value_of(prim, f"{usd.PREFIX}element")
        return Comment(
            id=prim.name,
            text=_text(prim, "text"),
            author=_text(prim, "author"),
            time=_text(prim, "time"),
            target=str(station) if station is not None else None if element is None else int(element),
            position_m=self._position(prim),
            resolved=bool(_yes(prim, "resolved", otherwise=False)),
            assignee=_text(prim, "assignee", otherwise=""),
            due=_text(prim, "due", otherwise=""),
            photo=_text(prim, "photo", otherwise=""),
        )

    def _verdict(self, prim: Any) -> tuple[str, Verdict]:
        return _text(prim, "station"), Verdict(
            verdict=_text(prim, "verdict"),
            by=_text(prim, "by"),
            time=_text(prim, "time"),
            note=_text(prim, "note", ""),
        )

    def _progress(self, prim: Any) -> tuple[str, StationProgress]:
        return _text(prim, "station"), StationProgress(_text(prim, "state"), _text(prim, "by"), _text(prim, "time"))

    def _sign_off(self, prim: Any) -> SignOff:
        return SignOff(
            name=_text(prim, "name"),
            time=_text(prim, "time"),
            plan_sha256=_text(prim, "planSha256"),
            revision=_whole(prim, "revision", _MISSING),
            note=_text(prim, "note", ""),
        )


def _text(prim: Any, name: str, otherwise: str = _MISSING) -> str:
    value = usd.value_of(prim, usd.PREFIX + name)
    if value is None and otherwise is not _MISSING:
        return otherwise
    if not isinstance(value, str):
        raise ReviewError(f"{name} is {value!r:.40}, expected text")
    return value


def _whole(prim: Any, name: str, otherwise: int) -> int:
    value = usd.value_of(prim, usd.PREFIX + name)
    if value is None and otherwise is not _MISSING:
        return otherwise
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ReviewError(f"{name} is {value!r:.40}, expected a whole number, 0 or more")
    return value


def _yes(prim: Any, name: str, *, otherwise: bool | None) -> bool | None:
    value = usd.value_of(prim, usd.PREFIX + name)
    if value is None:
        return otherwise
    if not isinstance(value, bool):
        raise ReviewError(f"{name} is {value!r:.40}, expected true or false")
    return value


def _height(value: Any, *, otherwise: float | None) -> float | None:
    """NaN: it is not known."""
    if value is None:
        return otherwise
    return None if math.isnan(value) else rounded_height_m(value)
