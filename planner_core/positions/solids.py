"""Solids: what fills the columns of a grid, as heights that do not overlap, and what of it can be stood on.

Local frame, metres. Footprints of triangles are merged where no foot fits between them:

    ====  ceiling and roof: one solid
                                     headroom of the solid below
    ====  slab, screed and doormat: one solid, its top is ground
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.positions.footprints import Footprints, Grid, footprints

#: Surfaces this near below a solid's top share in being its top: coverings on their slab, treads beside their riser.
_SAME_TOP_M = 0.1
#: Surfaces nearer than this are one, for a mover that climbs nothing too.
_LEAST_GAP_M = 0.02


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
