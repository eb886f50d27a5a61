"""Where plumb lines through points meet triangles: points (N, 3), corners (T, 3, 3) -> pairs and heights.

Local frame, metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array

#: Points are treated in square columns of this side, larger where there would be more than `_MAX_COLUMNS` a side.
_COLUMN_M = 1.0
_MAX_COLUMNS = 64
#: Points are moved by this, a different way from all that architects draw, so that no line hits an edge.
_ASIDE_M = np.array([6.18e-5, 4.14e-5])
#: Point x triangle pairs at once; bounds memory to some hundred megabytes.
_CHUNK = 1_000_000


@dataclass(frozen=True)
class Crossings:
    """point, triangle : (M,) int64 numbers of the two that meet. z_m : (M,) height of the triangle there."""

    point: Int64Array
    triangle: Int64Array
    z_m: FloatArray


def crossings(points_m: FloatArray, corners_m: FloatArray) -> Iterator[Crossings]:
    """Yield what plumb lines meet, a part of the points at a time; all of one point come together.

    Parameters
    ----------
    points_m
        (N, 3); their heights do not matter. Less than 0.1 mm beside an edge either answer may come.
    corners_m
        (T, 3, 3). Triangles that stand upright are never met.
    """
    for points, triangles in _columns(points_m, corners_m):
        step = max(1, _CHUNK // max(1, triangles.size))
        for first in range(0, points.size, step):
            part = points[first : first + step]
            point, triangle, z_m = _met(points_m[part], corners_m[triangles])
            yield Crossings(part[point], triangles[triangle], z_m)


def _columns(points_m: FloatArray, corners_m: FloatArray) -> Iterator[tuple[Int64Array, Int64Array]]:
    """Points of a square column, and the triangles that its plumb lines may meet."""
    if not points_m.shape[0] or not corners_m.shape[0]:
        return
    low, high = corners_m[:, :, :2].min(axis=1), corners_m[:, :, :2].max(axis=1)
    start = points_m[:, :2].min(axis=0)
    side_m = max(_COLUMN_M, float(np.ptp(points_m[:, :2], axis=0).max()) / _MAX_COLUMNS)
    cell = np.floor((points_m[:, :2] - start) / side_m).astype(np.int64)
    for x in np.unique(cell[:, 0]).tolist():
        strip = np.flatnonzero(cell[:, 0] == x)
        x_m = points_m[strip, 0]
        near = np.flatnonzero((low[:, 0] <= x_m.max()) & (high[:, 0] >= x_m.min()))
        for y in np.unique(cell[strip, 1]).tolist():
            points = strip[cell[strip, 1] == y]
            y_m = points_m[points, 1]
            triangles = near[(low[near, 1] <= y_m.max()) & (high[near, 1] >= y_m.min())]
            if triangles.size:
                yield points, triangles


def _met(points_m: FloatArray, corners_m: FloatArray) -> tuple[Int64Array, Int64Array, FloatArray]:
    """Pairs that meet, and the heights of the triangles there."""
    # Relative to the first corner, for precision.
    a = corners_m[:, 0]
    ab, ac = corners_m[:, 1] - a, corners_m[:, 2] - a
    twice_area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    number = np.flatnonzero(np.abs(twice_area) > 1e-12)
    a, ab, ac, twice_area = a[number], ab[number], ac[number], twice_area[number]
    x = points_m[:, 0, None] + _ASIDE_M[0] - a[:, 0]
    y = points_m[:, 1, None] + _ASIDE_M[1] - a[:, 1]
    lb = (x * ac[:, 1] - y * ac[:, 0]) / twice_area
    lc = (y * ab[:, 0] - x * ab[:, 1]) / twice_area
    point, at = np.nonzero((lb >= 0) & (lc >= 0) & (lb + lc <= 1))
    z_m = a[at, 2] + lb[point, at] * ab[at, 2] + lc[point, at] * ac[at, 2]
    return point.astype(np.int64), number[at].astype(np.int64), z_m
