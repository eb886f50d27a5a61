"""Solids: what fills the columns of a grid, as heights that do not overlap, and what of it can be stood on.

Local frame, metres, float64. Footprints of triangles are merged where no foot fits between them:

    ====  ceiling and roof: one solid
                                     headroom of the solid below
    ====  slab, screed and doormat: one solid, its top is ground

Footprints are the heights between which each triangle passes through each cell, exact and of every cell that it
touches, however thin or upright it is: what stands in the way of a body may be a sheet of a millimetre that no plumb
line meets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.compiled import compiled
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.model.arrays import bounds_of

#: Surfaces this near below a solid's top share in being its top: coverings on their slab, treads beside their riser.
_SAME_TOP_M = 0.1
#: Surfaces nearer than this are one, for a carrier that climbs nothing too.
_LEAST_GAP_M = 0.02
#: Pairs of one band of rows; bounds memory to some hundred megabytes.
_BAND_PAIRS = 3_000_000
#: A triangle this far outside a cell, in cells, still touches it: rounding.
_SLACK = 1e-9


@dataclass(frozen=True)
class Solids:
    """Solids of all columns, sorted by column and height.

    column : (S,) int64. bottom_m, top_m : (S,) float64. can_stand : (S,) bool, the top is not too steep.
    ground_floor : (S,) int32, floor whose ground the top is; -1: none's.
    """

    column: Int64Array
    bottom_m: FloatArray
    top_m: FloatArray
    can_stand: BoolArray
    ground_floor: Int32Array

    def headroom_m(self) -> FloatArray:
        """(S,) float64: from each top to the solid above; inf under open sky."""
        out = np.full(self.column.size, np.inf)
        same = self.column[1:] == self.column[:-1]
        out[:-1][same] = (self.bottom_m[1:] - self.top_m[:-1])[same]
        return out

    def first_above(self, column: Int64Array, z_m: FloatArray) -> Int64Array:
        """(N,) the lowest solid of columns (N,) whose top is above heights (N,); -1 where there is none."""
        if not self.column.size:
            return np.full(column.size, -1, dtype=np.int64)
        low_m, high_m = float(self.top_m.min()), float(self.top_m.max())
        stride_m = high_m - low_m + 3.0
        key = self.column * stride_m + (self.top_m - low_m + 1.0)
        wanted = column * stride_m + (np.clip(z_m, low_m - 1.0, high_m + 1.0) - low_m + 1.0)
        at = np.searchsorted(key, wanted, side="right")
        found = at < key.size
        found[found] = self.column[at[found]] == column[found]
        return np.where(found, at, -1)


def find_solids(
    corners_m: FloatArray, level: BoolArray, ground_floor: Int32Array, grid: Grid, *, step_m: float
) -> Solids:
    """Merge the footprints of triangles (K, 3, 3) whose gaps are at most `step_m`.

    level : (K,) bool, triangles flat enough to stand on. ground_floor : (K,) int32, floor whose ground they are, or -1.
    """
    gap_m = max(step_m, _LEAST_GAP_M)
    bands = [_merge(found, level, ground_floor, gap_m) for found in footprints(corners_m, grid)]
    return Solids(
        column=np.concatenate([np.empty(0, np.int64), *(band.column for band in bands)]),
        bottom_m=np.concatenate([np.empty(0), *(band.bottom_m for band in bands)]),
        top_m=np.concatenate([np.empty(0), *(band.top_m for band in bands)]),
        can_stand=np.concatenate([np.empty(0, bool), *(band.can_stand for band in bands)]),
        ground_floor=np.concatenate([np.empty(0, np.int32), *(band.ground_floor for band in bands)]),
    )


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


def _merge(found: Footprints, level: BoolArray, ground_floor: Int32Array, gap_m: float) -> Solids:
    order = np.lexsort((found.low_m, found.column))
    column, triangle = found.column[order], found.triangle[order]
    low, high = found.low_m[order], found.high_m[order]
    if not column.size:
        none = np.empty(0)
        return Solids(column, none, none, none.astype(bool), none.astype(np.int32))
    # The highest so far in each column: columns are stacked on one axis, far enough apart not to mix.
    base_m = float(low.min())
    stride_m = float(high.max()) - base_m + 2.0 * gap_m + 1.0
    raised = (column - column[0]) * stride_m
    reached = np.maximum.accumulate(high - base_m + raised)
    starts = np.flatnonzero(np.append(True, (low - base_m + raised)[1:] > reached[:-1] + gap_m))
    top = np.maximum.reduceat(high, starts)
    below_top = np.repeat(top, np.diff(np.append(starts, column.size))) - high
    stands = level[triangle] & (below_top <= gap_m)
    floor = np.where(below_top <= _SAME_TOP_M, ground_floor[triangle], -1)
    return Solids(
        column=column[starts],
        bottom_m=np.minimum.reduceat(low, starts),
        top_m=top,
        can_stand=np.logical_or.reduceat(stands, starts),
        ground_floor=np.maximum.reduceat(floor, starts).astype(np.int32),
    )


def _boxes(corners_m: FloatArray, grid: Grid) -> tuple[Int64Array, Int64Array]:
    """First and last cell, each (K, 2), of the triangles' bounds inside the grid."""
    plan = (corners_m[:, :, :2] - grid.low_m) / grid.cell_m
    last_cell = np.array([grid.nx, grid.ny]) - 1
    low, high = bounds_of(plan)
    first = np.clip(np.floor(low - _SLACK), 0, None)
    last = np.minimum(np.floor(high + _SLACK), last_cell)
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
    n_pairs = int((size[0] * size[1]).sum())
    column, triangle = np.empty(n_pairs, np.int64), np.empty(n_pairs, np.int64)
    low_m, high_m = np.empty(n_pairs), np.empty(n_pairs)
    grid_low_m, cell_m = np.asarray(grid.low_m, dtype=np.float64), float(grid.cell_m)
    corners_m = np.asarray(corners_m, dtype=np.float64)
    n = _fill(corners_m, grid_low_m, cell_m, grid.nx, which, *first, *size, column, triangle, low_m, high_m)
    return Footprints(column[:n], triangle[:n], low_m[:n], high_m[:n])


@compiled
def _fill(
    corners_m: FloatArray,
    grid_low_m: FloatArray,
    cell_m: float,
    nx: int,
    which: Int64Array,
    first_x: Int64Array,
    first_y: Int64Array,
    n_x: Int64Array,
    n_y: Int64Array,
    column: Int64Array,
    triangle: Int64Array,
    low_m: FloatArray,
    high_m: FloatArray,
) -> int:
    """Write the cells that triangles `which` touch, and the heights between which they do, and return their number.

    The part of a triangle over a cell is a convex polygon; its corners lie on the triangle's edges, clipped to the
    cell, or they are corners of the cell.
    """
    n = 0
    x, y, z = np.empty(3), np.empty(3), np.empty(3)
    for index in range(which.size):
        corners = corners_m[which[index]]
        for row in range(first_y[index], first_y[index] + n_y[index]):
            for across in range(first_x[index], first_x[index] + n_x[index]):
                # Coordinates in cells, from the cell's low corner: the cell is the unit square.
                for k in range(3):
                    x[k] = (corners[k, 0] - grid_low_m[0]) / cell_m - across
                    y[k] = (corners[k, 1] - grid_low_m[1]) / cell_m - row
                    z[k] = corners[k, 2]
                low, high = np.inf, -np.inf
                for a in range(3):
                    b = (a + 1) % 3
                    t_in, t_out = _clip(x[a], x[b], y[a], y[b])
                    if t_in <= t_out:
                        z_in, z_out = z[a] + t_in * (z[b] - z[a]), z[a] + t_out * (z[b] - z[a])
                        low, high = min(low, z_in, z_out), max(high, z_in, z_out)
                abx, aby, acx, acy = x[1] - x[0], y[1] - y[0], x[2] - x[0], y[2] - y[0]
                twice_area = abx * acy - aby * acx
                if abs(twice_area) > _SLACK:
                    scale = 1.0 / twice_area
                    for corner in range(4):
                        cx, cy = float(corner % 2), float(corner // 2)
                        to_b = ((cx - x[0]) * acy - (cy - y[0]) * acx) * scale
                        to_c = ((cy - y[0]) * abx - (cx - x[0]) * aby) * scale
                        if to_b >= 0 and to_c >= 0 and to_b + to_c <= 1:
                            height = z[0] + to_b * (z[1] - z[0]) + to_c * (z[2] - z[0])
                            low, high = min(low, height), max(high, height)
                if low <= high:
                    column[n], triangle[n] = row * nx + across, which[index]
                    low_m[n], high_m[n] = low, high
                    n += 1
    return n


@compiled
def _clip(ax: float, bx: float, ay: float, by: float) -> tuple[float, float]:
    """Parameters at which an edge a to b enters and leaves the unit square; enter > leave where it misses it."""
    t_in, t_out = 0.0, 1.0
    for a, d in ((ax, bx - ax), (ay, by - ay)):
        if abs(d) > _SLACK:
            scale = 1.0 / d
            t0, t1 = (-_SLACK - a) * scale, (1.0 + _SLACK - a) * scale
            t_in, t_out = max(t_in, min(t0, t1)), min(t_out, max(t0, t1))
        elif a < -_SLACK or a > 1.0 + _SLACK:
            t_out = -1.0
    return t_in, t_out
