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

from planner_core.model import BoolArray, FloatArray, Floor, Int64Array, Scene
from planner_core.model.arrays import bounds_of

ROOM_WIDTH_M = 0.8
"""The narrowest rooms, a WC and a passage, have this width; walls of two sheets without top and bottom have less."""
#: No wall and no pier that goes on below the ground is as thick: what encloses more is the hull of a building.
_HULL_WIDTH_M = 3.0
#: A bottom is on the ground where it is this near: screeds and coverings lie under the walls or beside them.
_FLUSH_M = 0.05
#: Points that stand for an area: the share that votes for a room is then true to some hundredths.
_N_POINTS = 400
#: Ground under less of an area than this is seen past its outline alone.
_LEAST_GROUND = 0.1
#: Points are treated in square columns of this side, larger where there would be more than `_MAX_COLUMNS` a side.
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


def encloses_room(
    scene: Scene, floor: Floor, *, element: int, plan_m: FloatArray, width_m: float, cut_m: float
) -> bool:
    """Tell whether what an element encloses in plan is a room, not the inside of a wall, a column or a machine.

    Walls, floor and ceiling of a mesh are often parted by material and of one sheet: the walls' section is closed, and
    the ground lies inside. A solid has a bottom of its own on the ground or above it:

        ____________ ceiling           ______ top
        :          :                  |      |
        : room     : walls            | wall |
        ============ ground       ====|______|==== ground

    Parameters
    ----------
    element
        Index into `scene.elements`.
    plan_m
        (K, 2) points inside the area that the element encloses at the height `cut_m`, local frame.
    width_m
        Diameter of the largest circle in that area. Narrower than `ROOM_WIDTH_M`, nothing is a room.
    """
    if width_m < ROOM_WIDTH_M or not len(plan_m):
        return False
    plan_m = plan_m[:: -(-len(plan_m) // _N_POINTS)]
    is_ground = np.zeros(scene.n_triangles, dtype=np.bool_)
    is_ground[floor.ground_triangles] = True
    faces = np.flatnonzero(is_ground | (scene.element_of_triangle == element))
    bottom_m, ground_m, own_ground_m = (np.full(len(plan_m), -np.inf) for _ in range(3))
    if not floor.ground_triangles.size:
        ground_m[:] = floor.elevation_m
    points_m = np.column_stack([plan_m, np.full(len(plan_m), cut_m)])
    for met in crossings(points_m, scene.vertices_m[scene.triangles[faces]]):
        below = met.z_m < cut_m
        point, face, z_m = met.point[below], faces[met.triangle[below]], met.z_m[below]
        own = scene.element_of_triangle[face] == element
        np.maximum.at(bottom_m, point[own], z_m[own])
        for height_m, of_it in ((ground_m, ~own), (own_ground_m, own)):
            at = of_it & is_ground[face]
            np.maximum.at(height_m, point[at], z_m[at])
    # Undersides that are flush with the ground of others count as ground where no class parts them from it.
    own_ground = own_ground_m > ground_m + _FLUSH_M
    there = own_ground | np.isfinite(ground_m)
    if there.mean() < _LEAST_GROUND:
        return False
    sunk = (bottom_m < ground_m - _FLUSH_M) & (width_m >= _HULL_WIDTH_M)
    room: BoolArray = own_ground | np.isneginf(bottom_m) | sunk
    return bool(room[there].mean() > 0.5)


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
    low, high = bounds_of(corners_m[:, :, :2])
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
