"""Choosing few of many searched positions by their own worth: one a cell of a grid, or the best that lie well apart.

Input positions (N, 3), local frame, metres, with F1 (N,) and F2 (N,); output indices into them, the best first: least
F2, among equals most F1, among those the lower index. Positions with infinite F2 (never valid) are left out.

References
----------
López et al. 2023, section 4.1: Fig. 12 (one a cell) and Fig. 11, 14, 17 (greedy best k, with a least distance).
"""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int64Array


def by_worth(f1: Int64Array, f2: FloatArray) -> Int64Array:
    """Indices of all positions with finite F2, the best first."""
    order = np.lexsort((-f1, f2))
    return np.asarray(order[np.isfinite(f2[order])], dtype=np.int64)


def one_per_cell(
    positions_m: FloatArray,
    f1: Int64Array,
    f2: FloatArray,
    *,
    cell_m: tuple[float, float, float],
    origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Int64Array:
    """Keep the best position of each cell of a regular grid.

    cell_m : lengths along x, y, z; inf for one layer. origin_m : a corner of cells.

    Raises
    ------
    RequirementError
        A length that is not positive.
    """
    if not all(length > 0 for length in cell_m):
        raise RequirementError(f"cell_m: got {cell_m}, expected three lengths of more than 0; inf for a single layer")
    ranked = by_worth(f1, f2)
    relative = (positions_m[ranked] - np.array(origin_m)) / np.array(cell_m)
    cell = np.where(np.isinf(cell_m), 0.0, np.floor(relative))
    _, first = np.unique(cell, axis=0, return_index=True)
    return np.asarray(ranked[np.sort(first)])


def best_apart(
    positions_m: FloatArray, f1: Int64Array, f2: FloatArray, *, n: int, least_distance_m: float = 0.0
) -> Int64Array:
    """Take the best position, then ever the best that is at least `least_distance_m` from all taken: at most `n`.

    Raises
    ------
    RequirementError
        A negative number or distance.
    """
    if n < 0 or not least_distance_m >= 0:
        raise RequirementError(
            f"best positions: got n {n}, least_distance_m {least_distance_m:g}, expected 0 or more; e.g. 30 and 1"
        )
    left = by_worth(f1, f2)
    taken: list[int] = []
    while left.size and len(taken) < n:
        best, left = int(left[0]), left[1:]
        taken.append(best)
        left = left[np.linalg.norm(positions_m[left] - positions_m[best], axis=1) >= least_distance_m]
    return np.array(taken, dtype=np.int64)
