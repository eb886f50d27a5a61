"""The three spatial searches on one level from the same starts: what Fig. 12, 13 and 15 have in common."""

from __future__ import annotations

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search import SearchResult, SearchSettings, search
from planner_core.paper.search.station_fitness import StationFitness

from .figure import Bench
from .levels import Level

#: The paper's names of the methods that `search` takes.
SEARCHES = {"ls": "local search", "sa": "simulated annealing", "ts": "tabu search"}


def fitness_of(level: Level) -> StationFitness:
    """Return what searches on the level are guided by; it counts its scans."""
    distribution = PointDistribution(level.survey.scene, level.survey.patches, level.engine)
    return StationFitness(level.survey, level.settings, level.engine, distribution, floor=level.index)


def sees_nothing_m2(level: Level) -> float:
    """F2 of a station that sees nothing: the sum of all references."""
    return PointDistribution(level.survey.scene, level.survey.patches, level.engine).reference_total_m2


def run_search(
    bench: Bench, name: str, level: Level, starts_m: FloatArray, settings: SearchSettings
) -> tuple[SearchResult, StationFitness]:
    """Search from the starts, with a fitness of its own so that scans are counted anew."""
    fitness = fitness_of(level)
    return search(name, starts_m, fitness, settings, bounds_m=fitness.bounds_m, progress=bench.progress), fitness


def best_so_far(result: SearchResult) -> FloatArray:
    """(I + 1, N) least F2 that each agent has stood at up to each iteration; inf before a valid position."""
    return np.asarray(np.minimum.accumulate(result.history.f2, axis=0))


def gain(result: SearchResult) -> FloatArray:
    """(N,) how much each agent that started at a valid position lowered its F2, m2."""
    start = result.history.f2[0]
    return np.asarray(start[np.isfinite(start)] - result.f2[np.isfinite(start)])
