"""Which stations see which surfaces of rooms that are a plan extruded to a height: in whole numbers, without rounding.

Input walls in the plan, (W, 4) int64 centimetres x0 y0 x1 y1, and stations; output (N, P) bool. Walls reach from floor
to ceiling and are thin; both of their sides are surfaces. A surface is seen where the line in the plan to its middle
meets no other wall, not even in a point, its length in space is within range, and the angle of incidence is at most
75 degrees (a cosine squared of 1/15: 75.04 degrees). Coordinates are doubled, so that middles are whole, and stay below
2^15, so that every product below fits in 63 bits: same input, same bits, on every machine.

The four orientations of two segments' ends decide whether they meet, ends included.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, Int64Array

#: One over the least squared cosine of the angle of incidence.
STEEPEST = 15
LIMIT_CM, LIMIT_RANGE_CM = 2**14, 2**11


@dataclass(frozen=True)
class Surfaces:
    """Middles and areas of P surfaces: twice the coordinates in cm, (P, 3) int64, and (P,) int64 ticks of 1 cm2.

    wall : (P,) int64, -1 of floor and ceiling. side : (P,) int64, 1 where the wall's left side is meant, -1 the right.
    """

    twice_cm: Int64Array
    ticks: Int64Array
    wall: Int64Array
    side: Int64Array


def orientation(a: Int64Array, b: Int64Array, c: Int64Array) -> Int64Array:
    """Return 1 where c lies left of a to b, -1 right, 0 on the line; arrays (..., 2) that fit each other."""
    turn: Int64Array = np.sign(
        (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
    )
    return turn


def _between(a: Int64Array, b: Int64Array, c: Int64Array) -> BoolArray:
    """Whether c lies in the box of a and b."""
    return np.asarray(((np.minimum(a, b) <= c) & (c <= np.maximum(a, b))).all(axis=-1), dtype=np.bool_)


def meet(a: Int64Array, b: Int64Array, c: Int64Array, d: Int64Array) -> BoolArray:
    """Whether the segments a to b and c to d have a point in common."""
    abc, abd, cda, cdb = orientation(a, b, c), orientation(a, b, d), orientation(c, d, a), orientation(c, d, b)
    touch: BoolArray = (
        ((abc != abd) & (cda != cdb))
        | ((abc == 0) & _between(a, b, c))
        | ((abd == 0) & _between(a, b, d))
        | ((cda == 0) & _between(c, d, a))
        | ((cdb == 0) & _between(c, d, b))
    )
    return touch


def seen_from(
    stations_cm: Int64Array, surfaces: Surfaces, walls_cm: Int64Array, *, least_cm: int, most_cm: int
) -> BoolArray:
    """(N, P) bool: what stations (N, 3) at distances from least_cm to most_cm see."""
    if np.abs(walls_cm).max(initial=0) >= LIMIT_CM or most_cm >= LIMIT_RANGE_CM:
        raise ValueError(
            f"plan: got coordinates up to {np.abs(walls_cm).max(initial=0)} cm and a range of {most_cm} cm, expected "
            f"less than {LIMIT_CM} and {LIMIT_RANGE_CM}; give a smaller scale or range"
        )
    walls = 2 * walls_cm
    start, end = walls[:, :2], walls[:, 2:]
    sees = np.zeros((len(stations_cm), surfaces.ticks.size), dtype=bool)
    for number, station in enumerate(2 * stations_cm):
        square = ((surfaces.twice_cm - station) ** 2).sum(axis=1)
        at = np.flatnonzero((square >= (2 * least_cm) ** 2) & (square <= (2 * most_cm) ** 2))
        at = at[_steep(surfaces, at, walls, station, square[at])]
        near = _near(walls, station[:2], 2 * most_cm)
        blocked = meet(station[:2], surfaces.twice_cm[at, None, :2], start[None, near], end[None, near])
        blocked &= surfaces.wall[at, None] != near[None]
        sees[number, at] = ~blocked.any(axis=1)
    return sees


def _near(walls: Int64Array, at: Int64Array, reach: int) -> Int64Array:
    """Walls whose box comes within reach."""
    low, high = np.minimum(walls[:, :2], walls[:, 2:]), np.maximum(walls[:, :2], walls[:, 2:])
    return np.flatnonzero(((low <= at + reach) & (high >= at - reach)).all(axis=1))


def _steep(surfaces: Surfaces, at: Int64Array, walls: Int64Array, station: Int64Array, square: Int64Array) -> BoolArray:
    """Of surfaces `at`, whether they show the station their front at no more than the greatest angle of incidence.

    square : squared distances. Distances are below 2^12 and walls shorter than 2^17, so products stay below 2^62.
    """
    level = surfaces.wall[at] < 0
    wall = walls[np.maximum(surfaces.wall[at], 0)]
    run, to = wall[:, 2:] - wall[:, :2], station[:2] - wall[:, :2]
    over = (run[:, 0] * to[:, 1] - run[:, 1] * to[:, 0]) * surfaces.side[at]  # the distance from its line, times length
    along_normal = np.where(level, station[2] - surfaces.twice_cm[at, 2], over)
    length = np.where(level, 1, (run**2).sum(axis=1))
    front: BoolArray = (level | (over > 0)) & (STEEPEST * along_normal**2 >= length * square)
    return front
