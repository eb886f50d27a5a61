"""Storeys on pages and pictures of their own, which share no coordinates: one is moved over the other.

Most walls stand over walls. Sides of walls across each axis are summed over their length; where both storeys' sums
agree best, at a shift along that axis, the storeys lie over each other. A point that both show, by the user, decides
instead.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from planner_core.drawings.floor_plan import FloorPlan
from planner_core.drawings.room_outlines import RoomOutline
from planner_core.drawings.walls import WallPiece, edges_of
from planner_core.model import FloatArray

_BIN_M = 0.02
_LEAST_EDGE_M = 0.4
_SPREAD_BINS = 2
"""Sides count for their neighbours, too: two drawings of one wall differ by centimetres."""
_LEAST_SHARE = 0.3
_MOST_BINS = 50_000


def moved(plan: FloorPlan, by_m: FloatArray) -> FloorPlan:
    """Return a storey moved in plan, (2,) metres."""

    def shifted(area: Any) -> Any:
        return shapely.transform(area, lambda at: at + by_m)

    return replace(
        plan,
        walls=tuple(WallPiece(shifted(wall.area), wall.thickness_m) for wall in plan.walls),
        openings=tuple(replace(each, corners_m=each.corners_m + by_m) for each in plan.openings),
        rooms=tuple(RoomOutline(shifted(room.outline), room.name, room.long_name) for room in plan.rooms),
        outline=shifted(plan.outline),
        treads=tuple(replace(treads, foot=treads.foot + by_m) for treads in plan.treads),
        texts=tuple(replace(text, x=text.x + float(by_m[0]), y=text.y + float(by_m[1])) for text in plan.texts),
        lines=replace(plan.lines, points_m=plan.lines.points_m + by_m),
        from_picture=None if plan.from_picture is None else _shift(by_m) @ plan.from_picture,
    )


def _shift(by_m: FloatArray) -> FloatArray:
    return np.array([[1.0, 0.0, by_m[0]], [0.0, 1.0, by_m[1]], [0.0, 0.0, 1.0]])


def over(lower: FloorPlan, upper: FloorPlan, name: str) -> tuple[FloorPlan, str]:
    """Move a storey over the one below by their walls; returns it, and a line for the user."""
    below, above = (shapely.union_all([wall.area for wall in plan.walls]) for plan in (lower, upper))
    by_m = np.array([_shift_m(below, above, axis) for axis in (0, 1)])
    plan = moved(upper, by_m)
    common = shapely.intersection(below, shapely.transform(above, lambda at: at + by_m)).area
    share = common / min(below.area, above.area)
    line = (
        f"{name}: it has no coordinates and is moved by x {by_m[0]:.2f}, y {by_m[1]:.2f} m over the storey below, with "
        f"{100 * share:.0f} % of its walls over walls; if that is wrong, name a point that both show with --align."
    )
    if share < _LEAST_SHARE:
        line = (
            f"{name}: only {100 * share:.0f} % of its walls lie over walls of the storey below, expected 30 % or more: "
            "the storeys are likely shifted; name a point that both show with --align."
        )
    return plan, line


def _shift_m(below: Any, above: Any, axis: int) -> float:
    sides = [_sides(area, axis) for area in (below, above)]
    if not all(len(at) for at, _ in sides):
        return 0.0
    low = [float(at.min()) for at, _ in sides]
    n_bins = 1 + int(max(np.ptp(at) for at, _ in sides) / _BIN_M) + 2 * _SPREAD_BINS
    if n_bins > _MOST_BINS:
        return 0.0
    sums = []
    for (at, weight), begin in zip(sides, low, strict=True):
        row = np.rint((at - begin) / _BIN_M).astype(np.int64) + _SPREAD_BINS
        counted = np.bincount(row, weights=weight, minlength=n_bins + _SPREAD_BINS)
        sums.append(np.convolve(counted, np.bartlett(2 * _SPREAD_BINS + 3)[1:-1], mode="same"))
    agreement = np.correlate(sums[0], sums[1], mode="full")
    return low[0] - low[1] + float(np.argmax(agreement) - (len(sums[1]) - 1)) * _BIN_M


def _sides(area: Any, axis: int) -> tuple[FloatArray, FloatArray]:
    """Where sides of walls lie that run across an axis, and their lengths."""
    edges = edges_of(area)
    step = edges[:, 1] - edges[:, 0]
    length = np.hypot(step[:, 0], step[:, 1])
    runs = (length >= _LEAST_EDGE_M) & (np.abs(step[:, axis]) <= 0.05 * length)
    return edges[runs, :, axis].mean(axis=1), length[runs]
