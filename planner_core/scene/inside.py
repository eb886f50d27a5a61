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

from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.scene.plumb_lines import crossings


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
    for met in crossings(points_m, corners_m):
        keys, index = np.unique(met.point * n_shapes + shape_of_triangle[met.triangle], return_inverse=True)
        over = met.z_m > points_m[met.point, 2]
        above = np.bincount(index, weights=over, minlength=keys.size)
        below = np.bincount(index, weights=~over, minlength=keys.size)
        inside = keys[(above % 2 == 1) & (below % 2 == 1)]
        found.append(np.column_stack([inside // n_shapes, inside % n_shapes]))
    pairs = np.concatenate(found)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return Enclosures(point=pairs[:, 0], shape=pairs[:, 1])
