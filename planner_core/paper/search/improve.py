"""Spatial search: move positions to better ones nearby, guided by F2, many agents at a time.

Input starting positions (N, 3), local frame, metres, and a `Fitness`; output a `SearchResult` with the best position of
each agent and the way it went. The methods: `methods.py`.

References
----------
López et al. 2023, section 3.5.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planner_core.engine.scan_engine import check_positions
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int64Array
from planner_core.model.spatial_search import METHODS, SearchSettings
from planner_core.paper.search.agents import SearchResult, SearchState
from planner_core.paper.search.landscape import Fitness
from planner_core.paper.search.methods import Annealing, LocalSearch, TabuSearch
from planner_core.progress import Progress, ProgressEvent, silent

# ------------------------------------------------------------------------------------------------------------ thinning
# Choosing few of many searched positions by their own worth: one a cell of a grid, or the best that lie well apart.
# Input positions (N, 3), local frame, metres, with F1 (N,) and F2 (N,); output indices into them, the best first:
# least F2, among equals most F1, among those the lower index. Positions with infinite F2 (never valid) are left out.
# References ---------- López et al. 2023, section 4.1: Fig. 12 (one a cell) and Fig. 11, 14, 17 (greedy best k, with a
# least distance).


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


# ------------------------------------------------------------------------------------------------------------- improve
DEFAULTS = SearchSettings()


class _Method(Protocol):
    def step(self, iteration: int) -> None: ...


def search(
    method: str,
    starts_m: FloatArray,
    fitness: Fitness,
    settings: SearchSettings = DEFAULTS,
    *,
    bounds_m: FloatArray,
    progress: Progress = silent,
) -> SearchResult:
    """Improve each of `starts_m` by itself.

    Parameters
    ----------
    method
        `ls` greedy local search, `sa` simulated annealing, `ts` tabu search.
    starts_m
        (N, 3) float64, local frame. A start that is not valid counts as worse than any valid position.
    fitness
        Evaluates positions, many at a time, none outside the bounds.
    bounds_m
        (2, 3) float64, [[x, y, z least], [greatest]]: where agents may go, and where tabu search begins anew.

    Raises
    ------
    RequirementError
        An unknown method, positions or bounds that are not finite, not of that shape or too far from the lattice's
        origin, or a fitness that gives a valid position no finite F2.

    Notes
    -----
    The result depends on starts, landscape, settings and bounds alone, not on how many positions are judged at a time;
    an agent's result not even on the other agents, as long as its number among the starts stays the same.
    """
    bounds = _checked_bounds(bounds_m)
    if method not in METHODS:
        raise RequirementError(f"search: got {method!r}, expected one of {', '.join(METHODS)}")
    state = SearchState(check_positions(starts_m), fitness, settings, bounds)
    steps = _method(method, state)
    for iteration in range(1, settings.max_iterations + 1):
        n_moving = int(np.count_nonzero(state.moving))
        progress(ProgressEvent("search", iteration - 1, settings.max_iterations, f"{method}, {n_moving} moving"))
        if not n_moving:
            break
        state.count_iteration()
        steps.step(iteration)
        state.record()
    progress(ProgressEvent("search", settings.max_iterations, settings.max_iterations, method))
    return state.result()


def _method(name: str, state: SearchState) -> _Method:
    if name == "ls":
        return LocalSearch(state)
    return Annealing(state) if name == "sa" else TabuSearch(state)


def _checked_bounds(bounds_m: FloatArray) -> FloatArray:
    bounds = np.asarray(bounds_m, dtype=np.float64)
    if bounds.shape != (2, 3) or not np.isfinite(bounds).all() or (bounds[1] < bounds[0]).any():
        raise RequirementError(
            f"bounds_m: got {bounds.tolist()}, expected [[x, y, z], [x, y, z]] in metres, least first; see its floor"
        )
    return bounds
