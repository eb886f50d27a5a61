"""Rules that every change of a review keeps to: digits, heights, floors, ids that are there, or free."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from planner_core.errors import ReviewError
from planner_core.model.review import Review, check_height, check_id, check_point
from planner_core.model.site import Point
from planner_core.review.changes import Context

DIGITS = 6
"""Positions are kept to the micrometre: finer is noise, and what USD and JSON give back is then what was given."""

_Kept = TypeVar("_Kept")


def rounded_m(what: str, point_m: Point) -> Point:
    """Return a place to the micrometre; raises `ReviewError` where it is off the Earth."""
    check_point(what, point_m)
    x, y, z = (round(float(value), DIGITS) + 0.0 for value in point_m)  # + 0.0 turns -0.0 into 0.0
    return x, y, z


def rounded_height_m(height_m: float | None) -> float | None:
    """Return an instrument height to the micrometre; raises `ReviewError` where no tripod has it."""
    if height_m is None:
        return None
    check_height(height_m)
    return round(float(height_m), DIGITS) + 0.0


def checked_floor(floor: str, context: Context, *, empty: bool = False) -> str:
    """Return the id of a floor of the plan, or with `empty` none; raises `ReviewError` for others."""
    if floor in context.plan.floor_elevations_m or (empty and not floor):
        return floor
    known = ", ".join(context.plan.floor_elevations_m)
    raise ReviewError(f"floor: got {floor[:40]!r}, expected one of {known}; reload the plan")


def present(what: str, kept: Mapping[str, _Kept], name: str) -> _Kept:
    """Return what bears the name; raises `ReviewError` where nothing does."""
    if name not in kept:
        raise ReviewError(f"{what} {name[:40]}: is not there, expected one that is; reload the review")
    return kept[name]


def with_new(what: str, kept: Mapping[str, _Kept], name: str, new: _Kept) -> dict[str, _Kept]:
    """Return `kept` and something new; raises `ReviewError` where the name is taken, or is none."""
    check_id(name)
    if name in kept:
        raise ReviewError(f"{what} {name}: there is one already; leave the id out for a free one")
    return {**kept, name: new}


def without(kept: Mapping[str, _Kept], name: str) -> dict[str, _Kept]:
    """Return `kept` without one name, in whatever order it was."""
    return {key: value for key, value in kept.items() if key != name}


def free_id(letter: str, kind: str, kept: Iterable[str], review: Review) -> str:
    """Return the id after the last one of a kind that is in use, or was.

    Who still shows an object that was removed must not meet another one under its name.
    """
    was = (name.partition(":")[2] for name in review.touched if name.startswith(f"{kind}:"))
    names = {*kept, *was}
    numbers = [int(name[1:]) for name in names if name[:1] == letter and name[1:].isdecimal() and len(name) < 12]
    return f"{letter}{max(numbers, default=0) + 1:03d}"
