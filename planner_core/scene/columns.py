"""Vertical columns through a scene: where each of a grid of plumb lines meets which triangle.

Local frame, metres. Finding floors needs to know what lies above and below what; a plumb line on a grid gives it for
any mesh, closed or not, whichever way its triangles wind.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Scene
from planner_core.model.arrays import bounds_of
from planner_core.scene.array_rows import chunks

#: Grid points treated in one go; bounds memory to some hundred megabytes.
_CHUNK = 2_000_000
#: A grid point this far outside an edge, relative to the triangle's size, still counts: points on a shared edge must
#: not fall between two triangles.
_EDGE_SLACK = 1e-9
#: Crossings of one plumb line nearer than this are one surface: welded slabs, coverings laid flush.
SAME_SURFACE_M = 0.02


@dataclass(frozen=True)
class Columns:
    """Crossings of plumb lines with triangles, sorted by column and height.

    column : (N,) int64, iy * nx + ix. z_m : (N,) float64. triangle : (N,) int32.
    x_m : (nx,), y_m : (ny,) float64, the lines' places.
    """

    column: Int64Array
    z_m: FloatArray
    triangle: Int32Array
    x_m: FloatArray
    y_m: FloatArray

    def clear_height_m(self, among: BoolArray | None = None) -> FloatArray:
        """(N,) float64: height from each crossing to the next one above it; inf under open sky.

        among : (N,) bool, the crossings that count as something above; None: all.
        """
        shown = slice(None) if among is None else among
        column, z_m = self.column[shown], self.z_m[shown]
        # One sortable number a crossing. float64 resolves micrometres here: columns x extent stays below 1e10.
        low_m = float(self.z_m.min(initial=0.0))
        stride_m = float(self.z_m.max(initial=0.0)) - low_m + 1.0
        key = column * stride_m + (z_m - low_m)
        above = np.searchsorted(key, self.column * stride_m + (self.z_m - low_m) + SAME_SURFACE_M, side="right")
        out = np.full(self.z_m.size, np.inf)
        found = above < key.size
        found[found] = column[above[found]] == self.column[found]
        out[found] = z_m[above[found]] - self.z_m[found]
        return out

    def depth_to_m(self, among: BoolArray) -> FloatArray:
        """(N,) float64: from each crossing down to the next one below it that is `among` (N,) bool; inf over none."""
        last = int(self.column.max(initial=0))
        turned = Columns(last - self.column[::-1], -self.z_m[::-1], self.triangle[::-1], self.x_m, self.y_m)
        return turned.clear_height_m(among[::-1])[::-1]


def sample_columns(
    corners_m: FloatArray, triangle_ids: Int32Array, *, low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> Columns:
    """Meet the plumb lines at `low_m + step_m * (ix, iy)` with triangles.

    Parameters
    ----------
    corners_m
        (K, 3, 3) float64, local frame. Triangles that stand upright meet no plumb line.
    triangle_ids
        (K,) int32, what to call them in the result.
    low_m
        (2,) float64, x and y of the first line.
    shape
        (nx, ny), number of lines.
    """
    return _sorted(_crossings(corners_m, triangle_ids, low_m, step_m, shape), low_m, step_m, shape)


def sample_scene(
    scene: Scene, triangle_ids: Int32Array, *, low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> Columns:
    """`sample_columns` of some of a scene's triangles, (K,) int32, without all their corners at once."""
    met = (
        crossing
        for some in chunks(triangle_ids.size)
        for crossing in _crossings(
            scene.vertices_m[scene.triangles[triangle_ids[some]]], triangle_ids[some], low_m, step_m, shape
        )
    )
    return _sorted(met, low_m, step_m, shape)


def _sorted(
    met: Iterable[tuple[Int64Array, FloatArray, Int32Array]], low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> Columns:
    parts = [(np.empty(0, np.int64), np.empty(0), np.empty(0, np.int32)), *met]
    column, z_m, triangle = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    order = np.lexsort((triangle, z_m, column))
    return Columns(
        column=column[order],
        z_m=z_m[order],
        triangle=triangle[order],
        x_m=low_m[0] + step_m * np.arange(shape[0]),
        y_m=low_m[1] + step_m * np.arange(shape[1]),
    )


def _crossings(
    corners_m: FloatArray, triangle_ids: Int32Array, low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> Iterator[tuple[Int64Array, FloatArray, Int32Array]]:
    """Column, height and triangle of every crossing, some triangles at a time."""
    first, count = _index_boxes(corners_m, low_m, step_m, shape)
    n_points = count[:, 0] * count[:, 1]
    todo = np.flatnonzero(n_points)
    ends = np.cumsum(n_points[todo])
    start = 0
    while start < todo.size:
        done = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + _CHUNK, side="right")))
        part = todo[start:stop]
        column, z_m, owner = _meet(corners_m[part], first[part], count[part], low_m, step_m, shape[0])
        yield column, z_m, triangle_ids[part[owner]].astype(np.int32)
        start = stop


def _index_boxes(
    corners_m: FloatArray, low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> tuple[Int64Array, Int64Array]:
    """First line and number of lines, each (K, 2), inside the triangles' bounds."""
    plan = (corners_m[:, :, :2] - low_m) / step_m
    low, high = bounds_of(plan)
    slack = 1e-6
    first = np.clip(np.ceil(low - slack), 0, None)
    last = np.minimum(np.floor(high + slack), np.array(shape) - 1)
    count = np.maximum(last - first + 1, 0)
    return first.astype(np.int64), count.astype(np.int64)


def _meet(
    corners_m: FloatArray, first: Int64Array, count: Int64Array, low_m: FloatArray, step_m: float, n_x: int
) -> tuple[Int64Array, FloatArray, Int64Array]:
    n_points = count[:, 0] * count[:, 1]
    owner = np.repeat(np.arange(n_points.size), n_points)
    within = np.arange(owner.size) - np.repeat(np.cumsum(n_points) - n_points, n_points)
    ix = first[owner, 0] + within % count[owner, 0]
    iy = first[owner, 1] + within // count[owner, 0]
    # Relative to the first corner, for precision; the edge functions are twice the areas opposite b and c.
    a = corners_m[:, 0]
    ab, ac = corners_m[:, 1] - a, corners_m[:, 2] - a
    twice_area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    flat = np.abs(twice_area) > 1e-12
    px = low_m[0] + step_m * ix - a[owner, 0]
    py = low_m[1] + step_m * iy - a[owner, 1]
    scale = np.where(flat, twice_area, 1.0)[owner]
    lb = (px * ac[owner, 1] - py * ac[owner, 0]) / scale
    lc = (py * ab[owner, 0] - px * ab[owner, 1]) / scale
    inside = flat[owner] & (lb >= -_EDGE_SLACK) & (lc >= -_EDGE_SLACK) & (lb + lc <= 1.0 + _EDGE_SLACK)
    z_m = a[owner, 2] + lb * ab[owner, 2] + lc * ac[owner, 2]
    return (iy * n_x + ix)[inside], z_m[inside], owner[inside]
