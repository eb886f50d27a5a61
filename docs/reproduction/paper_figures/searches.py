"""The three spatial searches on one level from the same starts: what Fig. 12, 13 and 15 have in common."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search import SearchResult, SearchSettings, search
from planner_core.paper.search.station_fitness import StationFitness

from .figure import Bench
from .levels import Level

#: The paper's names of the methods that `search` takes.
SEARCHES = {"ls": "local search", "sa": "simulated annealing", "ts": "tabu search"}


#: Units of F2 by the distance that it takes: as Eq. 2 is printed, and as the text has it.
UNITS = {"squared": "m2", "euclidean": "m"}


def fitness_of(level: Level, *, distance: str = "squared") -> StationFitness:
    """Return what searches on the level are guided by; it counts its scans."""
    distribution = PointDistribution(level.survey.scene, level.survey.patches, level.engine, distance=distance)
    return StationFitness(level.tripods, distribution, floor=level.index)


def sees_nothing(level: Level, *, distance: str = "squared") -> float:
    """F2 of a station that sees nothing: the sum of all references."""
    judge = PointDistribution(level.survey.scene, level.survey.patches, level.engine, distance=distance)
    return judge.reference_total_m2


def run_search(
    bench: Bench,
    name: str,
    level: Level,
    starts_m: FloatArray,
    settings: SearchSettings,
    *,
    distance: str = "squared",
) -> tuple[SearchResult, StationFitness]:
    """Search from the starts, with a fitness of its own so that scans are counted anew."""
    fitness = fitness_of(level, distance=distance)
    return search(name, starts_m, fitness, settings, bounds_m=fitness.bounds_m, progress=bench.progress), fitness


def best_so_far(result: SearchResult) -> FloatArray:
    """(I + 1, N) least F2 that each agent has stood at up to each iteration; inf before a valid position."""
    return np.asarray(np.minimum.accumulate(result.history.f2, axis=0))


def gain(result: SearchResult) -> FloatArray:
    """(N,) how much each agent that started at a valid position lowered its F2, m2."""
    start = result.history.f2[0]
    return np.asarray(start[np.isfinite(start)] - result.f2[np.isfinite(start)])


def decided(squared: Mapping[str, bool], euclidean: Mapping[str, bool], *, same_verdict: bool) -> str:
    """Say what the choice of distance decides, of findings of the paper that hold or not with either."""
    verdict = "does not decide" if same_verdict else "decides"
    differ = [
        f"{name} ({'squared' if holds else 'plain'} alone)"
        for name, holds in squared.items()
        if holds != euclidean[name]
    ]
    of_findings = "; ".join(differ) if differ else f"none of the {len(squared)} findings"
    return f"The choice of distance {verdict} this verdict, and decides {of_findings}."
