"""Which closed shapes points lie inside: rooms (IfcSpace) by their outlines in space, solids by their faces.

Local frame, metres. A plumb line through a point inside a closed shape meets its faces an odd number of times above the
point, and an odd number of times below:

         __________
        |     :    |        above: 1
        |     o    |
        |_____:____|        below: 1    -> inside
        table =:=           other shapes are counted for themselves

The faces' winding does not matter: that of many spaces in real files is mixed. Shapes with holes at the sides keep
working; those without a top or a bottom hold nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array

#: Points are looked at in square columns of this side, larger where there would be more than `_MAX_COLUMNS` a side.
_COLUMN_M = 1.0
_MAX_COLUMNS = 64
#: Points are moved by this, a different way from all that architects draw, so that no line hits an edge.
_ASIDE_M = np.array([6.18e-5, 4.14e-5])
#: Point x triangle pairs at once; bounds memory to some hundred megabytes.
_CHUNK = 1_000_000


@dataclass(frozen=True)
class Enclosures:
    """Which points lie in which shapes, by point: point, shape : (M,) int64."""

    point: Int64Array
    shape: Int64Array


def enclosures(points_m: FloatArray, corners_m: FloatArray, shape_of_triangle: Int64Array) -> Enclosures:
    """Find the closed shapes around points.

    Parameters
    ----------
    points_m
        (N, 3), local frame. On a face, or less than 0.1 mm beside one that stands upright, either answer may come.
    corners_m
        (T, 3, 3).
    shape_of_triangle
        (T,) shape that each face is of, 0 or more.
    """
    n_shapes = int(shape_of_triangle.max(initial=-1)) + 1
    found = [np.zeros((0, 2), dtype=np.int64)]
    for points, triangles in _columns(points_m, corners_m):
        step = max(1, _CHUNK // max(1, triangles.size))
        for first in range(0, points.size, step):
            part = points[first : first + step]
            inside = _inside(points_m[part], corners_m[triangles], shape_of_triangle[triangles], n_shapes)
            found.append(np.column_stack([part[inside // n_shapes], inside % n_shapes]))
    pairs = np.concatenate(found)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return Enclosures(point=pairs[:, 0], shape=pairs[:, 1])


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


def _inside(points_m: FloatArray, corners_m: FloatArray, shape: Int64Array, n_shapes: int) -> Int64Array:
    """Numbers point * n_shapes + shape of the points inside."""
    # Relative to the first corner, for precision.
    a = corners_m[:, 0]
    ab, ac = corners_m[:, 1] - a, corners_m[:, 2] - a
    twice_area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    level = np.abs(twice_area) > 1e-12
    a, ab, ac, twice_area, shape = a[level], ab[level], ac[level], twice_area[level], shape[level]
    x = points_m[:, 0, None] + _ASIDE_M[0] - a[:, 0]
    y = points_m[:, 1, None] + _ASIDE_M[1] - a[:, 1]
    lb = (x * ac[:, 1] - y * ac[:, 0]) / twice_area
    lc = (y * ab[:, 0] - x * ab[:, 1]) / twice_area
    point, triangle = np.nonzero((lb >= 0) & (lc >= 0) & (lb + lc <= 1))
    z_m = a[triangle, 2] + lb[point, triangle] * ab[triangle, 2] + lc[point, triangle] * ac[triangle, 2]
    over = z_m > points_m[point, 2]
    keys, index = np.unique(point * n_shapes + shape[triangle], return_inverse=True)
    above = np.bincount(index, weights=over, minlength=keys.size)
    below = np.bincount(index, weights=~over, minlength=keys.size)
    return np.asarray(keys[(above % 2 == 1) & (below % 2 == 1)], dtype=np.int64)
