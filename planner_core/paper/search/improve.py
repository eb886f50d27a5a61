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
from planner_core.model import FloatArray
from planner_core.model.spatial_search import METHODS, SearchSettings
from planner_core.paper.search.agents import SearchResult, SearchState
from planner_core.paper.search.landscape import Fitness
from planner_core.paper.search.methods import Annealing, LocalSearch, TabuSearch
from planner_core.progress import Progress, ProgressEvent, silent

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
