"""The ground of a floor, below any position or on a grid: its height, from the floor's own triangles and nothing else.

Local frame, metres, float64. A ray into the scene meets tables and door leaves first; here nothing is in the way.
Triangles are found by a grid over the plan: each of its cells lists those whose bounds reach into it.
"""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Floor, Int64Array, Survey
from planner_core.model.arrays import bounds_of
from planner_core.scene.columns import sample_columns

#: Cells a side at most; bounds memory where few triangles are much larger than the others.
_MAX_CELLS = 256
#: Pairs of position and triangle taken in one go.
_CHUNK = 1_000_000
#: A place this far outside an edge, relative to the triangle's size, still counts: none falls between two triangles.
_EDGE_SLACK = 1e-9
#: A position this little below the ground still stands on it: rounding of sums of steps.
_BELOW_M = 1e-6
#: Two grounds of one column closer than this are one: a covering on its slab, the upper one counts.
_SAME_GROUND_M = 0.1


class GroundSurface:
    """Ground of one floor of `survey`. `low_m`, `high_m`: its least and greatest height."""

    def __init__(self, survey: Survey, floor: Floor) -> None:
        corners = survey.scene.vertices_m[survey.scene.triangles[floor.ground_triangles]].reshape(-1, 3, 3)
        self._a, self._ab, self._ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._twice_area = self._ab[:, 0] * self._ac[:, 1] - self._ab[:, 1] * self._ac[:, 0]
        self.low_m, self.high_m = float(corners[:, :, 2].min()), float(corners[:, :, 2].max())
        self._index(corners[:, :, :2])

    def below(self, positions_m: FloatArray) -> FloatArray:
        """(N,) float64: height of the highest ground at or below each of positions (N, 3); NaN where there is none."""
        cell = self._cell_of(positions_m[:, :2])
        inside = (cell >= 0).all(axis=1) & (cell < self._shape).all(axis=1)
        number = np.where(inside, cell[:, 1] * self._shape[0] + cell[:, 0], 0)
        count = np.where(inside, self._starts[number + 1] - self._starts[number], 0)
        highest = np.full(positions_m.shape[0], -np.inf)
        start, ends = 0, np.cumsum(count)
        while start < count.size:
            done = ends[start - 1] if start else 0
            stop = max(start + 1, int(np.searchsorted(ends, done + _CHUNK, side="right")))
            part = np.arange(start, stop)
            who = np.repeat(part, count[part])
            nth = np.arange(who.size) - np.repeat(np.cumsum(count[part]) - count[part], count[part])
            which = self._triangles[self._starts[number[who]] + nth]
            z_m, meets = self._meet(positions_m[who], which)
            np.maximum.at(highest, who[meets], z_m[meets])
            start = stop
        return np.where(np.isfinite(highest), highest, np.nan)

    def _meet(self, positions_m: FloatArray, which: Int64Array) -> tuple[FloatArray, BoolArray]:
        """Heights of triangles on the plumb lines of positions, pair by pair, and whether they are met below."""
        a, ab, ac = self._a[which], self._ab[which], self._ac[which]
        level = np.abs(self._twice_area[which]) > 1e-12
        scale = np.where(level, self._twice_area[which], 1.0)
        px, py = positions_m[:, 0] - a[:, 0], positions_m[:, 1] - a[:, 1]
        lb = (px * ac[:, 1] - py * ac[:, 0]) / scale
        lc = (py * ab[:, 0] - px * ab[:, 1]) / scale
        z_m = a[:, 2] + lb * ab[:, 2] + lc * ac[:, 2]
        inside = level & (lb >= -_EDGE_SLACK) & (lc >= -_EDGE_SLACK) & (lb + lc <= 1.0 + _EDGE_SLACK)
        return z_m, inside & (z_m <= positions_m[:, 2] + _BELOW_M)

    def _cell_of(self, plan_m: FloatArray) -> Int64Array:
        return np.asarray(np.floor((plan_m - self._origin_m) / self._cell_m), dtype=np.int64)

    def _index(self, plan_m: FloatArray) -> None:
        """List the triangles of plan (K, 3, 2) by cell, as compressed sparse rows."""
        low, high = bounds_of(plan_m)
        extent = high.max(axis=0) - low.min(axis=0)
        # About a triangle's size; and a margin, so that the rim lies inside a cell.
        self._cell_m = np.maximum((high - low).mean(axis=0), extent / (_MAX_CELLS - 2)) + 1e-6
        self._origin_m = low.min(axis=0) - 0.5 * self._cell_m
        self._shape = self._cell_of(high.max(axis=0)) + 1
        first, last = self._cell_of(low - 1e-6), self._cell_of(high + 1e-6)
        width = last - first + 1
        count = width.prod(axis=1)
        owner = np.repeat(np.arange(count.size), count)
        nth = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
        x = first[owner, 0] + nth % width[owner, 0]
        y = first[owner, 1] + nth // width[owner, 0]
        number = y * self._shape[0] + x
        order = np.argsort(number, kind="stable")
        self._triangles = owner[order]
        n_each = np.bincount(number, minlength=int(self._shape.prod()))
        self._starts = np.concatenate([[0], np.cumsum(n_each)])


def grid_on_ground(survey: Survey, floor: Floor, step_m: float) -> tuple[FloatArray, FloatArray, int]:
    """Grid points that have ground: places (N, 2), ground heights (N,); and the number of points without any."""
    extent = floor.bounds_m[1] - floor.bounds_m[0]
    n = np.floor(extent / step_m + 1e-9).astype(np.int64) + 1
    if float(n.prod()) > 1e7:
        raise RequirementError(
            f"grid_step_m: {step_m} makes {float(n.prod()):.3g} grid points on floor {floor.name!r}, expected at most "
            "1e7; use a larger step"
        )
    low = floor.bounds_m.mean(axis=0) - 0.5 * (n - 1) * step_m
    corners = survey.scene.vertices_m[survey.scene.triangles[floor.ground_triangles]]
    shape = (int(n[0]), int(n[1]))
    columns = sample_columns(corners, floor.ground_triangles, low_m=low, step_m=step_m, shape=shape)
    # The highest of crossings that lie within a covering's thickness: the last before a gap, sorted by height.
    last = np.ones(columns.z_m.size, dtype=bool)
    same = columns.column[1:] == columns.column[:-1]
    last[:-1] = ~same | (np.diff(columns.z_m) > _SAME_GROUND_M)
    column, ground_m = columns.column[last], columns.z_m[last]
    return _places(column, low, step_m, shape[0]), ground_m, int(n.prod()) - np.unique(column).size


def _places(column: Int64Array, low_m: FloatArray, step_m: float, n_x: int) -> FloatArray:
    index = np.column_stack([column % n_x, column // n_x]).astype(np.float64)
    return low_m + step_m * index
