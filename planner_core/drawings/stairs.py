"""Flights of stairs: lines of treads in the plans of two storeys -> straight flights from the one to the other.

    lower plan            upper plan
    |_|_|_|_ _            _ _|_|_|_|      treads: parallel lines of one length, a step apart
    foot      cut                 head    a plan shows no more than its cut or its slab leaves open

The plan below shows a flight from its foot up to the cut, the plan above from its head down as far as the void reaches.
Together they show which way it rises; a plan alone does not. Plan coordinates, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from planner_core.drawings.walls import segments_of
from planner_core.model import FloatArray

_GOING_M = (0.18, 0.42)
"""Treads are so deep."""
_WIDTH_M = (0.55, 4.0)
_SAME_M = 0.06
"""Nosing and riser of one tread are nearer to each other, and ends of treads of one flight differ by less."""
_EVEN = 0.2
"""Treads of a flight are equally deep to this share."""
_LEAST_TREADS = 3
_SAME_ANGLE_RAD = np.deg2rad(2.0)
_BESIDE_M = 0.3
"""Treads of one flight in two plans are shifted aside by less."""
_APART_M = 4.0
"""The part of a flight that neither plan shows is shorter."""


@dataclass(frozen=True)
class Treads:
    """What one plan shows of a flight. foot : (2,) a corner; along : (2,) unit vector up or down; across : to the left.

    Treads lie from `foot` over `run_m` along and over `width_m` across.
    """

    foot: FloatArray
    along: FloatArray
    run_m: float
    width_m: float

    @property
    def across(self) -> FloatArray:
        """Unit vector."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def area(self) -> Any:
        """Shapely polygon."""
        return rectangle(self.foot, self.along, self.run_m, self.width_m)


@dataclass(frozen=True)
class Flight:
    """A flight between two storeys. foot : (2,) a corner of its lowest tread; along : (2,) unit vector, upwards."""

    foot: FloatArray
    along: FloatArray
    run_m: float
    width_m: float

    @property
    def area(self) -> Any:
        """Shapely polygon."""
        return rectangle(self.foot, self.along, self.run_m, self.width_m)


def rectangle(foot: FloatArray, along: FloatArray, length_m: float, width_m: float) -> Any:
    """Return the rectangle from a corner, along a unit vector and to its left."""
    across = np.array([-along[1], along[0]])
    return shapely.Polygon(
        [foot, foot + length_m * along, foot + length_m * along + width_m * across, foot + width_m * across]
    )


def unclear_stairs(strokes: Sequence[FloatArray], file: str) -> tuple[str, ...]:
    """A warning where lines of stairs, metres, hold no flight: winding stairs are none."""
    if len(strokes) < _LEAST_TREADS or treads_of(strokes):
        return ()
    return (
        f"{file}: its stairs ({len(strokes)} lines) have no straight flight of {_LEAST_TREADS} treads and are left "
        "out, so they join no storeys; winding stairs are not recognised: add them to the IFC file.",
    )


def treads_of(lines: Sequence[FloatArray]) -> list[Treads]:
    """Find rows of treads among the lines (K, 2) of stairs, from the lowest corner."""
    segments = segments_of(lines)
    step = segments[:, 1] - segments[:, 0]
    length = np.hypot(step[:, 0], step[:, 1])
    segments, step = (each[(length >= _WIDTH_M[0]) & (length <= _WIDTH_M[1])] for each in (segments, step))
    angle = np.arctan2(step[:, 1], step[:, 0]) % np.pi
    group = np.rint(angle / _SAME_ANGLE_RAD).astype(np.int64) % round(np.pi / _SAME_ANGLE_RAD)
    found = []
    for number in np.unique(group).tolist():
        direction = float(number * _SAME_ANGLE_RAD)
        found += _rows(segments[group == number], np.array([np.cos(direction), np.sin(direction)]))
    return sorted(found, key=lambda treads: tuple(np.round(shapely.bounds(treads.area), 3).tolist()))


def _rows(segments: FloatArray, across: FloatArray) -> list[Treads]:
    """Rows of treads among lines (M, 2, 2) that run along `across`."""
    along = np.array([across[1], -across[0]])
    at = (segments @ along).mean(axis=1)
    ends = np.sort(segments @ across, axis=1)
    left = set(np.argsort(at, kind="stable").tolist())
    order = [int(row) for row in np.argsort(at, kind="stable")]
    found = []
    for first in order:
        if first not in left:
            continue
        row = [first]
        for other in order:
            same_width = np.abs(ends[other] - ends[first]).max() <= _SAME_M
            deep = at[other] - at[row[-1]]
            if other not in left or not same_width or deep <= _SAME_M:
                continue
            going = at[row[1]] - at[row[0]] if len(row) > 1 else None
            if deep > _GOING_M[1] or deep < _GOING_M[0]:
                if deep > _GOING_M[1]:
                    break
                continue
            if going is not None and abs(deep - going) > _EVEN * going:
                continue
            row.append(other)
        if len(row) < _LEAST_TREADS:
            continue
        low, high = at[first], at[row[-1]]
        beside = (np.abs(ends - ends[first]).max(axis=1) <= _SAME_M) & (at >= low - _SAME_M) & (at <= high + _SAME_M)
        left -= set(np.flatnonzero(beside).tolist())
        begin, end = ends[row].mean(axis=0)
        # `along` is to the right of `across`, so that the foot's left is `across`.
        foot = low * along + begin * across
        found.append(Treads(foot, along, float(high - low), float(end - begin)))
    return found


def flights_between(lower: Sequence[Treads], upper: Sequence[Treads]) -> list[Flight]:
    """Flights of which both plans show treads; those that only one shows are none."""
    flights = []
    for below in lower:
        for above in upper:
            flight = _flight(below, above)
            if flight is not None:
                flights.append(flight)
                break
    return flights


def _flight(below: Treads, above: Treads) -> Flight | None:
    along, across = below.along, below.across
    if abs(abs(along @ above.along) - 1.0) > 1e-3:
        return None
    corners = shapely.get_coordinates(above.area)[:4] - below.foot
    over, aside = corners @ along, corners @ across
    low, high = float(over.min()), float(over.max())
    if abs(aside.min()) > _BESIDE_M or abs(aside.max() - below.width_m) > _BESIDE_M:
        return None
    if max(low - below.run_m, -high) > _APART_M:
        return None
    begin, end = min(low, 0.0), max(high, below.run_m)
    # The end that the lower plan shows, and the upper one shows least beyond, is the foot.
    is_up = -low < high - below.run_m if low < below.run_m and high > 0.0 else low >= below.run_m
    if is_up:
        return Flight(below.foot + begin * along, along, end - begin, below.width_m)
    return Flight(below.foot + end * along + below.width_m * across, -along, end - begin, below.width_m)
