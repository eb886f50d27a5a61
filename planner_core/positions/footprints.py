"""Footprints: the heights between which each triangle passes through each cell of a grid in plan.

Local frame, metres, float64. Every cell that a triangle touches is found, however thin or upright it is, and the
heights are exact: what stands in the way of a body may be a sheet of a millimetre that no plumb line meets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array

#: Pairs of triangle and cell looked at in one go; keeps the working set in the cache.
_CHUNK = 200_000
#: Pairs of one band of rows; bounds memory to some hundred megabytes.
_BAND_PAIRS = 3_000_000
#: A triangle this far outside a cell, in cells, still touches it: rounding.
_SLACK = 1e-9


@dataclass(frozen=True)
class Grid:
    """Square cells in plan: cell (ix, iy) is column iy * nx + ix, its low corner at low_m + cell_m * (ix, iy)."""

    low_m: FloatArray
    cell_m: float
    nx: int
    ny: int

    def centre_m(self, column: Int64Array) -> FloatArray:
        """(N, 2) centres of columns (N,)."""
        index = np.column_stack([column % self.nx, column // self.nx])
        return np.asarray(self.low_m + self.cell_m * (index + 0.5))

    def index_of(self, plan_m: FloatArray) -> Int64Array:
        """(N, 2) cells of places (N, 2), which may lie outside the grid."""
        return np.floor((plan_m - self.low_m) / self.cell_m).astype(np.int64)


@dataclass(frozen=True)
class Footprints:
    """Pieces of triangles in cells. column, triangle : (M,) int64. low_m, high_m : (M,) float64, least, greatest z."""

    column: Int64Array
    triangle: Int64Array
    low_m: FloatArray
    high_m: FloatArray


def footprints(corners_m: FloatArray, grid: Grid) -> Iterator[Footprints]:
    """Yield the footprints of triangles (K, 3, 3) band of rows by band, each column whole in one band."""
    first, last = _boxes(corners_m, grid)
    width = np.maximum(last[:, 0] - first[:, 0] + 1, 0)
    some = np.flatnonzero((width > 0) & (last[:, 1] >= first[:, 1]))
    for low_row, end_row in _bands(first[some, 1], last[some, 1], width[some], grid.ny):
        here = some[(first[some, 1] < end_row) & (last[some, 1] >= low_row)]
        y0, y1 = np.maximum(first[here, 1], low_row), np.minimum(last[here, 1], end_row - 1)
        yield _of_band(corners_m, grid, here, (first[here, 0], y0), (width[here], y1 - y0 + 1))


def _boxes(corners_m: FloatArray, grid: Grid) -> tuple[Int64Array, Int64Array]:
    """First and last cell, each (K, 2), of the triangles' bounds inside the grid."""
    plan = (corners_m[:, :, :2] - grid.low_m) / grid.cell_m
    last_cell = np.array([grid.nx, grid.ny]) - 1
    first = np.clip(np.floor(plan.min(axis=1, initial=np.inf) - _SLACK), 0, None)
    last = np.minimum(np.floor(plan.max(axis=1, initial=-np.inf) + _SLACK), last_cell)
    return np.minimum(first, last_cell + 1).astype(np.int64), np.maximum(last, -1).astype(np.int64)


def _bands(first: Int64Array, last: Int64Array, width: Int64Array, n_rows: int) -> Iterator[tuple[int, int]]:
    """Rows [low, end) of about `_BAND_PAIRS` pairs each, at least a row."""
    change = np.zeros(n_rows + 1, dtype=np.int64)
    np.add.at(change, first, width)
    np.add.at(change, last + 1, -width)
    ends = np.cumsum(np.cumsum(change[:-1]))
    low = 0
    while low < n_rows:
        done = int(ends[low - 1]) if low else 0
        end = max(low + 1, int(np.searchsorted(ends, done + _BAND_PAIRS, side="right")))
        yield low, end
        low = end


def _of_band(
    corners_m: FloatArray,
    grid: Grid,
    which: Int64Array,
    first: tuple[Int64Array, Int64Array],
    size: tuple[Int64Array, Int64Array],
) -> Footprints:
    count = size[0] * size[1]
    ends = np.cumsum(count)
    parts: list[tuple[Int64Array, Int64Array, FloatArray, FloatArray]] = []
    start = 0
    while start < which.size:
        done = int(ends[start - 1]) if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + _CHUNK, side="right")))
        part = slice(start, stop)
        owner = np.repeat(np.arange(start, stop), count[part])
        nth = np.arange(owner.size) - np.repeat(ends[part] - count[part] - done, count[part])
        for low in range(0, owner.size, _CHUNK):  # a large triangle alone has more pairs than a chunk
            o, n = owner[low : low + _CHUNK], nth[low : low + _CHUNK]
            x, y = first[0][o] + n % size[0][o], first[1][o] + n // size[0][o]
            z_low, z_high, touches = _heights(corners_m[which[o]], grid, x, y)
            parts.append(((y * grid.nx + x)[touches], which[o][touches], z_low[touches], z_high[touches]))
        start = stop
    empty = (np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0), np.empty(0))
    column, triangle, z_low, z_high = (np.concatenate(field) for field in zip(empty, *parts, strict=True))
    return Footprints(column, triangle, z_low, z_high)


def _heights(
    corners_m: FloatArray, grid: Grid, x: Int64Array, y: Int64Array
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Least and greatest height of triangles (M, 3, 3) inside cells, and whether they touch them at all.

    The part of a triangle over a cell is a convex polygon; its corners lie on the triangle's edges, clipped to the
    cell, or they are corners of the cell.
    """
    # Coordinates in cells, from the cell's low corner: the cell is the unit square.
    px = [(corners_m[:, k, 0] - grid.low_m[0]) / grid.cell_m - x for k in range(3)]
    py = [(corners_m[:, k, 1] - grid.low_m[1]) / grid.cell_m - y for k in range(3)]
    pz = [corners_m[:, k, 2] for k in range(3)]
    low, high = np.full(x.size, np.inf), np.full(x.size, -np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        t_in, t_out = _clip(px[a], px[b], py[a], py[b])
        passes = t_in <= t_out
        for t in (t_in, t_out):
            z = pz[a] + t * (pz[b] - pz[a])
            np.minimum(low, z, out=low, where=passes)
            np.maximum(high, z, out=high, where=passes)
    _corners_inside(px, py, pz, low, high)
    return low, high, low <= high


def _clip(ax: FloatArray, bx: FloatArray, ay: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Parameters at which edges a to b enter and leave the unit square; enter > leave where they miss it."""
    t_in, t_out = np.zeros(ax.size), np.ones(ax.size)
    for a, d in ((ax, bx - ax), (ay, by - ay)):
        along = np.abs(d) > _SLACK
        scale = 1.0 / np.where(along, d, 1.0)
        t0, t1 = (-_SLACK - a) * scale, (1.0 + _SLACK - a) * scale
        t_in = np.maximum(t_in, np.where(along, np.minimum(t0, t1), 0.0))
        t_out = np.minimum(t_out, np.where(along, np.maximum(t0, t1), 1.0))
        beside = ~along & ((a < -_SLACK) | (a > 1.0 + _SLACK))
        t_out = np.where(beside, -1.0, t_out)
    return t_in, t_out


def _corners_inside(
    px: list[FloatArray], py: list[FloatArray], pz: list[FloatArray], low: FloatArray, high: FloatArray
) -> None:
    """Widen low and high by the triangles' heights at those of the square's corners that lie inside them."""
    abx, aby, acx, acy = px[1] - px[0], py[1] - py[0], px[2] - px[0], py[2] - py[0]
    twice_area = abx * acy - aby * acx
    flat = np.abs(twice_area) > _SLACK
    scale = 1.0 / np.where(flat, twice_area, 1.0)
    for cx, cy in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)):
        lb = ((cx - px[0]) * acy - (cy - py[0]) * acx) * scale
        lc = ((cy - py[0]) * abx - (cx - px[0]) * aby) * scale
        inside = flat & (lb >= 0) & (lc >= 0) & (lb + lc <= 1)
        z = pz[0] + lb * (pz[1] - pz[0]) + lc * (pz[2] - pz[0])
        np.minimum(low, z, out=low, where=inside)
        np.maximum(high, z, out=high, where=inside)
